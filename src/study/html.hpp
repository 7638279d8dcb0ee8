/// \file
/// Parts of a page of HTML that needs no other files.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace train_derail::study::html {

/// Returns a text with all characters escaped that have a meaning in HTML. Bytes that are not UTF-8 or not allowed in
/// XML become U+FFFD.
std::string escape(const std::string& text);

std::string base64(const std::string& bytes);

/// A column of a table: its title, and whether its cells are numbers, aligned to the right.
struct PageColumn {
  std::string title;
  bool numeric = false;
};
/// Returns a table; the cells are plain text, not HTML.
std::string table(const std::vector<PageColumn>& columns, const std::vector<std::vector<std::string>>& rows);

/// Returns a table without a head: one line for each name and its value.
std::string facts(const std::vector<std::pair<std::string, std::string>>& lines);

/// Returns the pictures in a folder by their names. If there are an SVG and a PNG of one name, the SVG is taken.
std::vector<std::string> pictures_in(const std::string& folder);

/// Returns a picture as embedded data, with its title below it; an SVG holds its title, of others it is the file name.
/// Throws std::runtime_error if the file cannot be read.
std::string figure(const std::string& path);

/// Returns a whole page with title and with a style for screen and print.
std::string page(const std::string& title, const std::string& body);

}  // namespace train_derail::study::html
