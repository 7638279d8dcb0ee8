/// \file
/// Numbers with a decimal point, whatever the locale of the process is.
#pragma once

#include <locale.h>

namespace train_derail::inputs {

/// As long as an object lives, C functions of this thread (strtod, printf) use the C locale. RViz and other Qt programs
/// set the locale of the user, in which 1.5 may be written 1,5. Other threads are not changed.
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
