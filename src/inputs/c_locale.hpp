// Numbers with a decimal point, whatever the locale of the process is.
#pragma once

#include <locale.h>

namespace train_derail::inputs {

/// While it lives, C functions of this thread (strtod, printf) follow the C locale. RViz and other Qt programs take the
/// user's, where 1.5 may be 1,5; other threads are not touched.
class CLocale {
 public:
  CLocale() : c_(::newlocale(LC_ALL_MASK, "C", nullptr)), before_(::uselocale(c_)) {}
  ~CLocale() {
    ::uselocale(before_);
    ::freelocale(c_);
  }
  CLocale(const CLocale&) = delete;
  CLocale& operator=(const CLocale&) = delete;

 private:
  locale_t c_, before_;
};

}  // namespace train_derail::inputs
