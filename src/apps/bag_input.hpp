/// \file
/// `derail replay BAG`: reads runs from a bag. ROS libraries are loaded only if this is asked for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace train_derail::apps {

/// Returns the documents (scene::Replay) of run `run_id` of a bag; 0: of all of its runs. Several nodes may each have a
/// run of this number. `name` stands for a scenario without a title. Throws std::runtime_error, which names the file,
/// if it is no bag, cannot be read, or has no such run, or if this build has no ROS.
std::vector<std::string> read_bag(const std::string& path, std::uint32_t run_id, const std::string& name);

/// Name of the function in the module (kBagModule), and its type.
inline constexpr char kReadBagFunction[] = "train_derail_read_bag";
using ReadBag = void (*)(const std::string& path, std::uint32_t run_id, const std::string& name,
                         std::vector<std::string>& documents);

}  // namespace train_derail::apps
