// Tables: what is written is read back, and what is no table is refused with its line.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "folder.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/text.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

class CsvTest : public test::Folder {
 protected:
  void write(const std::string& text) const { Folder::write("t.csv", text); }
  /// Line and reason, without the path.
  std::string error(const std::string& text) {
    write(text);
    try {
      files::CsvTable table(path_.string());
      for (std::vector<std::string> row; table.next(row);) {
      }
    } catch (const files::CsvError& e) {
      EXPECT_EQ(std::string(e.what()).compare(0, path_.string().size(), path_.string()), 0);
      return std::to_string(e.line()) + ": " + e.problem();
    }
    return "no error";
  }

  const fs::path path_ = folder_ / "t.csv";
};

TEST_F(CsvTest, WhatIsWrittenIsReadBack) {
  const std::vector<std::vector<std::string>> rows{
      {"a", "b", "c"}, {"hopper, steel", "say \"hi\"", ""},           {"two\nlines", "\r\n", " blanks "},
      {"", "", ""},    {"\"", ",", "Z\xC3\xBCrich \xF0\x9F\x9A\x82"}, {"#", "'", ";"}};
  std::string text;
  for (const auto& row : rows) text += files::csv_row(row) + "\n";
  write(text);
  files::CsvReader reader(path_.string());
  std::vector<std::string> row;
  for (const auto& wanted : rows) {
    ASSERT_TRUE(reader.next(row));
    EXPECT_EQ(row, wanted);
    std::string problem;
    EXPECT_TRUE(files::csv_fields(files::csv_row(wanted), row, problem)) << problem;
    EXPECT_EQ(row, wanted);
  }
  EXPECT_FALSE(reader.next(row));
  EXPECT_EQ(reader.line(), 8U) << "line of the last row, after one of three lines";
  EXPECT_EQ(files::csv_field("0.225"), "0.225") << "no quotes where none are needed";
  write(files::csv_row({""}) + "\n");
  files::CsvReader one(path_.string());
  ASSERT_TRUE(one.next(row)) << "a single empty field is a row";
  EXPECT_EQ(row, std::vector<std::string>{""});
}

TEST_F(CsvTest, TablesOfOtherProgramsAreRead) {
  write("\xEF\xBB\xBFname,mph\r\n\r\n\"Minot, ND\",41\r\nx,\"1\"\"2\"");
  files::CsvTable table(path_.string());
  EXPECT_EQ(table.names(), (std::vector<std::string>{"name", "mph"}));
  std::vector<std::string> row;
  ASSERT_TRUE(table.next(row));
  EXPECT_EQ(row, (std::vector<std::string>{"Minot, ND", "41"}));
  EXPECT_EQ(table.line(), 3U);
  EXPECT_EQ(table.number(row, table.column("mph")), 41.0);
  ASSERT_TRUE(table.next(row));
  EXPECT_EQ(row[1], "1\"2");
  EXPECT_THROW(table.number(row, 1), files::CsvError);
  EXPECT_FALSE(table.next(row));
  EXPECT_THROW(table.column("kmh"), files::CsvError);
}

TEST_F(CsvTest, WhatIsNoTableIsRefusedWithItsLine) {
  EXPECT_EQ(error(""), "0: is empty");
  EXPECT_EQ(error("a,b\n1,2\n3\n"), "3: 1 fields, but 2 columns");
  EXPECT_EQ(error("a,b\n1,2,3\n"), "2: 3 fields, but 2 columns");
  EXPECT_EQ(error("a,a\n"), "1: two columns have the name 'a'");
  EXPECT_EQ(error("a,b\n1,\"2\n3,4\n"), "2: a double quote is not closed");
  EXPECT_EQ(error("a,b\n1,\"2\"3\n"), "2: field 2: text after the closing double quote");
  EXPECT_EQ(error("a,b\n1,2\"3\n"), "2: field 2: a double quote within a field that does not begin with one");
  EXPECT_EQ(error("a,b\n1,2\r3\n"), "2: field 2: a carriage return in the middle of a line");
  EXPECT_EQ(error("a,b\n1,\xFF\n"), "2: not UTF-8");
  EXPECT_EQ(error("a,b\n1,2\n\"x\ny\xC0\xAF\",2\n"), "4: not UTF-8");
  EXPECT_EQ(error(std::string("a,b\n1,\0\n", 8)), "2: not UTF-8");
  EXPECT_EQ(error("a,b\n" + std::string(files::CsvReader::kRowMax + 1, '1')), "2: longer than 1048576 bytes");
  std::string lines;  // none of them too long
  for (std::size_t i = 0; i <= files::CsvReader::kRowMax; i += 8) lines += "1234567\n";
  EXPECT_EQ(error("a,b\n\"" + lines + "\",2\n"), "2: longer than 1048576 bytes");
}

TEST_F(CsvTest, OnlyPlainFiles) {
  EXPECT_THROW(files::CsvReader reader(path_.string()), files::CsvError);
  EXPECT_THROW(files::CsvReader reader(path_.parent_path().string()), files::CsvError);
  EXPECT_THROW(files::CsvReader reader("/dev/zero"), files::CsvError);
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_THROW(files::CsvReader reader(path_.string()), files::CsvError) << "not waited for";
}

TEST(Utf8, WhatUnicodeForbids) {
  for (const char* good : {"", "a", "\xC3\xBC", "\xED\x9F\xBF", "\xEE\x80\x80", "\xF4\x8F\xBF\xBF"})
    EXPECT_TRUE(files::is_utf8(good)) << good;
  for (const char* bad : {"\x80", "\xC0\x80", "\xC3", "\xE0\x80\x80", "\xED\xA0\x80", "\xF0\x80\x80\x80",
                          "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "a\xFF"}) {
    EXPECT_FALSE(files::is_utf8(bad)) << bad;
  }
  EXPECT_FALSE(files::is_utf8(std::string_view("a\0b", 3)));
}

TEST(Printable, WhatATerminalCannotShow) {
  EXPECT_EQ(files::printable("Z\xC3\xBCrich"), "Z\xC3\xBCrich");
  EXPECT_EQ(files::printable("a\x1b[2Jb\nc\xC2\x9b"
                             "d\xFF\x7f"),
            "a\\x1b[2Jb\\nc\\u009bd\\xff\\x7f");
  EXPECT_EQ(files::printable(std::string(300, 'x'), files::kShownMax), std::string(200, 'x') + "...");
  EXPECT_EQ(files::printable("\xC3\xBC\xC3\xBC", 1), "\xC3\xBC...") << "not in the middle of a character";
}

}  // namespace
}  // namespace train_derail
