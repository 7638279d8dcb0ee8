// Pieces of a page of HTML that needs nothing beside itself.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace train_derail::study::html {

/// Text as text, whatever it holds; bytes that are not UTF-8 or not allowed in XML become U+FFFD.
std::string escape(const std::string& text);

std::string base64(const std::string& bytes);

/// `numeric[i]`: column i is set flush right.
struct PageColumn {
  std::string title;
  bool numeric = false;
};
/// Cells are text, not HTML.
std::string table(const std::vector<PageColumn>& columns, const std::vector<std::vector<std::string>>& rows);

/// A table without a head: name and value a line.
std::string facts(const std::vector<std::pair<std::string, std::string>>& lines);

/// All pictures of a folder by name, an SVG before a PNG of the same name.
std::vector<std::string> pictures_in(const std::string& folder);

/// A picture embedded, with the title that an SVG carries (else its name) below it. Throws std::runtime_error.
std::string figure(const std::string& path);

/// A whole page: title, style for screen and print.
std::string page(const std::string& title, const std::string& body);

}  // namespace train_derail::study::html
