/// \file
/// Named values, saved and restored by one and the same walk over them. What is saved comes back bit for bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace train_derail::files {

/// A value that cannot be restored. what() is "name: problem".
class ArchiveError : public std::runtime_error {
 public:
  ArchiveError(std::string name, std::string problem);
  /// The value, with the groups and lists it lies in: "trucks.pairs.[3].a"; empty: all of it.
  const std::string& name() const { return name_; }
  /// What is wrong with it.
  const std::string& problem() const { return problem_; }

 private:
  std::string name_, problem_;
};

/// A walk names each value once: `archive.value("time", time_)`. A saving archive notes the value, a restoring one puts
/// the noted value in its place. Values of groups and lists are named within them.
class Archive {
 public:
  /// Saves.
  Archive();
  /// Restores from what bytes() gave. Throws ArchiveError if it is anything else.
  explicit Archive(const std::vector<std::uint8_t>& bytes);
  ~Archive();
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;

  /// All that has been saved, in CBOR (RFC 8949).
  std::vector<std::uint8_t> bytes() const;
  bool restoring() const;

  // Restoring, all of these throw ArchiveError.

  void value(std::string_view name, double& v);
  void value(std::string_view name, std::string& v);
  void value(std::string_view name, std::vector<std::uint8_t>& v);
  /// Whole numbers, enumerations and bool.
  template <class T, std::enable_if_t<std::is_integral_v<T> || std::is_enum_v<T>, int> = 0>
  void value(std::string_view name, T& v) {
    auto whole = static_cast<std::int64_t>(v);
    integer(name, whole);
    v = static_cast<T>(whole);
  }
  /// `count` numbers: restoring wants as many as were saved.
  void numbers(std::string_view name, double* v, std::ptrdiff_t count);
  /// An array of Eigen or of the standard library that keeps its length.
  template <class Column>
  void column(std::string_view name, Column& c) {
    numbers(name, c.data(), static_cast<std::ptrdiff_t>(c.size()));
  }
  /// As many flags as there are.
  void flags(std::string_view name, std::vector<bool>& v);

  /// Calls walk() for the values of a group.
  template <class Walk>
  void group(std::string_view name, const Walk& walk) {
    enter(name);
    walk();
    leave();
  }
  /// Calls walk(item) for every item; restoring first makes the list as long as it was.
  template <class T, class Walk>
  void list(std::string_view name, std::vector<T>& items, const Walk& walk) {
    items.resize(enter_list(name, items.size()));
    for (std::size_t i = 0; i < items.size(); ++i) {
      enter_item(i);
      walk(items[i]);
      leave();
    }
    leave();
  }

 private:
  struct Impl;
  void integer(std::string_view name, std::int64_t& v);
  void enter(std::string_view name);
  std::size_t enter_list(std::string_view name, std::size_t size);
  void enter_item(std::size_t index);
  void leave();

  std::unique_ptr<Impl> impl_;
};

}  // namespace train_derail::files
