/// \file
/// Codes of causes of accidents, by group. Accidents of one group begin in the same way.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "train_derail/validation/accidents.hpp"

namespace train_derail::validation {

/// Groups of codes, from a file such as config/types/fra_causes.yaml, which also gives their source.
struct CauseGroups {
  /// A group.
  struct Group {
    std::string name;                   ///< name in files: letters, digits and _
    std::string title;                  ///< name in tables
    std::vector<std::string> codes;     ///< its codes, as reports have them
    std::vector<std::string> families;  ///< beginnings of codes: the group of codes that no group lists
  };
  std::string path;           ///< path of the file; empty if none was read
  std::vector<Group> groups;  ///< the last one also has the codes of no group and no family

  /// The group of a code, and whether a group lists the code. An empty code, and one of no family, has the last group.
  struct Found {
    const Group* group;  ///< never null once a file was read
    bool listed;         ///< whether the group lists it
  };
  /// Returns the group of a code.
  Found find(const std::string& code) const;
};

/// Reads the file of groups. Throws inputs::InputError, also if a code or a family is given twice.
CauseGroups read_cause_groups(const std::string& path);

/// Returns a remark for each code of the table that no group lists: the code, in how many rows it is, and which group
/// is taken. Rows without a code have one remark together.
std::vector<std::string> unlisted_causes(const CauseGroups& groups, const AccidentTable& table);

}  // namespace train_derail::validation
