/// \file
/// Refuses a file of another kind before it is read.
#pragma once

#include <string>

#include "train_derail/files/recognise.hpp"

namespace train_derail::inputs {

/// Throws InputError if a path is recognised as another kind of file than the wanted one: "PATH: is a study (derail
/// study takes it); allowed: a scenario". A file that is not recognised is left to its reader, and so is a table of
/// unknown columns where a table is wanted: the reader names the columns that it lacks.
void expect(files::FileKind wanted, const std::string& path);

}  // namespace train_derail::inputs
