#include "train_derail/files/archive.hpp"

#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace train_derail::files {

using Json = nlohmann::json;

ArchiveError::ArchiveError(std::string name, std::string problem)
    : std::runtime_error(name.empty() ? problem : name + ": " + problem),
      name_(std::move(name)),
      problem_(std::move(problem)) {}

struct Archive::Impl {
  bool restoring = false;
  Json root = Json::object();
  std::vector<Json*> open{&root};  // the group, list or item that the walk is in, last
  std::vector<std::string> path;   // their names

  [[noreturn]] void fail(std::string_view name, const std::string& what) const {
    std::vector<std::string> all = path;
    all.emplace_back(name);
    throw ArchiveError(fmt::format("{}", fmt::join(all, ".")), what);
  }

  const Json& find(std::string_view name) const {
    const auto found = open.back()->find(std::string(name));
    if (found == open.back()->end()) fail(name, "missing");
    return *found;
  }

  Json& put(std::string_view name) { return (*open.back())[std::string(name)]; }

  /// Of a list or group that is restored.
  Json& container(std::string_view name, Json::value_t type, const char* what) {
    const auto found = open.back()->find(std::string(name));
    if (found == open.back()->end()) fail(name, "missing");
    if (found->type() != type) fail(name, fmt::format("not a {}", what));
    return *found;
  }

  void go_into(Json& inner, std::string name) {
    open.push_back(&inner);
    path.push_back(std::move(name));
  }
};

Archive::Archive() : impl_(std::make_unique<Impl>()) {}

Archive::Archive(const std::vector<std::uint8_t>& bytes) : impl_(std::make_unique<Impl>()) {
  impl_->restoring = true;
  impl_->root = Json::from_cbor(bytes, true, false);
  if (!impl_->root.is_object()) throw ArchiveError("", "not what an archive has saved, or not the whole of it");
}

Archive::~Archive() = default;

std::vector<std::uint8_t> Archive::bytes() const { return Json::to_cbor(impl_->root); }

bool Archive::restoring() const { return impl_->restoring; }

void Archive::value(std::string_view name, double& v) {
  if (!impl_->restoring) {
    impl_->put(name) = v;
    return;
  }
  const Json& found = impl_->find(name);
  if (!found.is_number()) impl_->fail(name, "not a number");
  v = found.get<double>();
}

void Archive::value(std::string_view name, std::string& v) {
  if (!impl_->restoring) {
    impl_->put(name) = v;
    return;
  }
  const Json& found = impl_->find(name);
  if (!found.is_string()) impl_->fail(name, "not a text");
  v = found.get<std::string>();
}

void Archive::value(std::string_view name, std::vector<std::uint8_t>& v) {
  if (!impl_->restoring) {
    impl_->put(name) = Json::binary(v);
    return;
  }
  const Json& found = impl_->find(name);
  if (!found.is_binary()) impl_->fail(name, "not a string of bytes");
  v = found.get_binary();
}

void Archive::integer(std::string_view name, std::int64_t& v) {
  if (!impl_->restoring) {
    impl_->put(name) = v;
    return;
  }
  const Json& found = impl_->find(name);
  if (!found.is_number_integer()) impl_->fail(name, "not a whole number");
  v = found.get<std::int64_t>();
}

void Archive::numbers(std::string_view name, double* v, std::ptrdiff_t count) {
  if (!impl_->restoring) {
    impl_->put(name) = std::vector<double>(v, v + count);
    return;
  }
  const Json& found = impl_->container(name, Json::value_t::array, "list");
  if (static_cast<std::ptrdiff_t>(found.size()) != count)
    impl_->fail(name, fmt::format("{} numbers; allowed: {}", found.size(), count));
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const Json& number = found[static_cast<std::size_t>(i)];
    if (!number.is_number()) impl_->fail(name, "not a list of numbers");
    v[i] = number.get<double>();
  }
}

void Archive::flags(std::string_view name, std::vector<bool>& v) {
  if (!impl_->restoring) {
    impl_->put(name) = v;
    return;
  }
  const Json& found = impl_->container(name, Json::value_t::array, "list");
  if (found.size() != v.size()) impl_->fail(name, fmt::format("{} flags; allowed: {}", found.size(), v.size()));
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!found[i].is_boolean()) impl_->fail(name, "not a list of flags");
    v[i] = found[i].get<bool>();
  }
}

void Archive::enter(std::string_view name) {
  Json& inner =
      impl_->restoring ? impl_->container(name, Json::value_t::object, "group") : (impl_->put(name) = Json::object());
  impl_->go_into(inner, std::string(name));
}

std::size_t Archive::enter_list(std::string_view name, std::size_t size) {
  Json& inner = impl_->restoring ? impl_->container(name, Json::value_t::array, "list")
                                 : (impl_->put(name) = Json(size, Json::object()));
  impl_->go_into(inner, std::string(name));
  return inner.size();
}

void Archive::enter_item(std::size_t index) {
  Json& inner = (*impl_->open.back())[index];
  const std::string name = fmt::format("[{}]", index);
  if (!inner.is_object()) impl_->fail(name, "not a group");
  impl_->go_into(inner, name);
}

void Archive::leave() {
  impl_->open.pop_back();
  impl_->path.pop_back();
}

}  // namespace train_derail::files
