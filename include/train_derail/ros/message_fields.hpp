/// \file
/// Fills messages from the description of outputs (fields::Fields) and reads them back, field by field of the same
/// name.
#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include "train_derail/fields/field.hpp"

namespace train_derail::ros_face {

/// Returns the names of a message's fields in their order, without constants. They come from its definition.
template <class Message>
std::vector<std::string> field_names() {
  std::vector<std::string> names;
  std::istringstream definition(::ros::message_traits::definition<Message>());
  for (std::string line; std::getline(definition, line) && line.rfind("====", 0) != 0;) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string type, name;
    if (!(words >> type >> name)) continue;
    const bool constant = line.substr(0, line.find('#')).find('=') != std::string::npos;
    if (!constant) names.push_back(name);
  }
  return names;
}

namespace detail {

/// Takes part in the serialization of a message as a stream, and so meets its fields in the order of the definition.
template <class Use>
class Walker {
 public:
  explicit Walker(Use use) : use_(use) {}
  template <class T>
  void next(T& field) {
    use_(number_++, field);
  }

 private:
  Use use_;
  std::size_t number_ = 0;
};

template <class Message, class Use>
void walk(Message& message, const Use& use) {
  Walker<Use> walker(use);
  ::ros::serialization::Serializer<std::remove_const_t<Message>>::template allInOne<Walker<Use>, Message&>(walker,
                                                                                                           message);
}

/// The entries in the order of the message's fields; null for a field without one.
template <class Message, class Record>
std::vector<const fields::Field<Record>*> match(const fields::Fields<Record>& all) {
  std::vector<const fields::Field<Record>*> matched;
  for (const std::string& name : field_names<Message>()) matched.push_back(all.find(name));
  return matched;
}

/// Sets a field of a message to what `entry` reads from the record; leaves nested messages alone.
template <class T, class Record>
void assign(T& to, const fields::Field<Record>& entry, const Record& from) {
  if constexpr (std::is_arithmetic_v<T>) to = static_cast<T>(entry.number(from));
  else if constexpr (std::is_constructible_v<fields::Value, T>) to = std::get<T>(entry.get(from));
}

inline fields::Value value_of(double field, const fields::Value&) { return field; }
inline fields::Value value_of(const std::string& field, const fields::Value&) { return field; }
inline fields::Value value_of(const std::vector<std::string>& field, const fields::Value&) { return field; }
template <class T>
fields::Value value_of(const T& field, const fields::Value& kind) {
  if constexpr (std::is_integral_v<T>) {
    if (std::holds_alternative<bool>(kind)) return field != 0;
    return static_cast<std::int64_t>(field);
  } else {
    return kind;
  }
}

}  // namespace detail

/// Sets the fields of `message` that `all` has an entry for, and leaves the others alone.
template <class Message, class Record>
void fill(Message& message, const fields::Fields<Record>& all, const Record& record) {
  static const auto matched = detail::match<Message>(all);
  detail::walk(message, [&](std::size_t i, auto& field) {
    if (matched[i] != nullptr) detail::assign(field, *matched[i], record);
  });
}

/// Returns the record that a message tells of. Members that are in no field of the message keep their defaults.
template <class Record, class Message>
Record read(const Message& message, const fields::Fields<Record>& all) {
  static const auto matched = detail::match<Message>(all);
  Record record;
  detail::walk(message, [&](std::size_t i, const auto& field) {
    if (matched[i] == nullptr || !matched[i]->set) return;
    matched[i]->set(record, detail::value_of(field, matched[i]->get(record)));
  });
  return record;
}

}  // namespace train_derail::ros_face
