/// \file
/// Computing that releases Python's interpreter and that Ctrl-C ends.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <future>

#include <pybind11/pybind11.h>

namespace train_derail::python {

/// Calls work(stop) on a thread of its own with the interpreter released, and returns what it returns. Meanwhile this
/// thread lets Python handle signals, and calls `look`, if there is one, with the interpreter held. If either raises
/// an exception, `stop` is set, and the exception goes on once `work` has returned.
template <class Work>
auto interruptibly(const Work& work, const std::function<void()>& look = {}) {
  namespace py = pybind11;
  constexpr std::chrono::milliseconds kPatience{50};
  std::atomic<bool> stop{false};
  auto result = std::async(std::launch::async, [&work, &stop] { return work(stop); });
  const auto done = [&result, kPatience] {
    const py::gil_scoped_release release;
    return result.wait_for(kPatience) == std::future_status::ready;
  };
  try {
    while (!done()) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (look) look();
    }
  } catch (...) {
    stop = true;
    const py::gil_scoped_release release;
    result.wait();
    throw;
  }
  return result.get();
}

}  // namespace train_derail::python
