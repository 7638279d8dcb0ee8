// What an archive saves comes back bit for bit; what it cannot restore it names.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "train_derail/files/archive.hpp"

namespace train_derail::files {
namespace {

enum class Colour { red, green };

struct Thing {
  double number = 0.1;
  std::int64_t whole = 0;
  bool yes = false;
  Colour colour = Colour::red;
  std::string text;
  std::vector<double> column = std::vector<double>(3);
  std::vector<bool> flags = std::vector<bool>(2);
  std::vector<Thing> items;

  void walk(Archive& archive) {
    archive.value("number", number);
    archive.group("inner", [&] {
      archive.value("whole", whole);
      archive.value("yes", yes);
      archive.value("colour", colour);
    });
    archive.value("text", text);
    archive.column("column", column);
    archive.flags("flags", flags);
    archive.list("items", items, [&](Thing& item) { item.walk(archive); });
  }
};

std::vector<std::uint8_t> saved(Thing thing) {
  Archive archive;
  thing.walk(archive);
  return archive.bytes();
}

std::string refusal(const std::vector<std::uint8_t>& bytes, Thing thing) {
  try {
    Archive archive(bytes);
    thing.walk(archive);
  } catch (const ArchiveError& e) {
    return e.what();
  }
  return "";
}

TEST(Archive, WhatIsSavedComesBackBitForBit) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double number : {0.1, -0.0, 1.0 / 3.0, 5e-324, 1.7e308, kInfinity, -kInfinity, 1e15 + 0.3}) {
    Thing thing;
    thing.number = number;
    thing.whole = -9007199254740993;
    thing.yes = true;
    thing.colour = Colour::green;
    thing.text = "a \"b\"\n";
    thing.column = {number, 2.0, -3.25};
    thing.flags = {true, false};
    thing.items = {Thing{}, thing, Thing{}};
    Thing again;
    Archive archive(saved(thing));
    EXPECT_TRUE(archive.restoring());
    again.walk(archive);
    EXPECT_EQ(again.number, number);
    EXPECT_EQ(std::signbit(again.number), std::signbit(number));
    EXPECT_EQ(again.whole, thing.whole);
    EXPECT_TRUE(again.yes);
    EXPECT_EQ(again.colour, Colour::green);
    EXPECT_EQ(again.text, thing.text);
    EXPECT_EQ(again.column, thing.column);
    EXPECT_EQ(again.flags, thing.flags);
    ASSERT_EQ(again.items.size(), 3U);
    EXPECT_EQ(again.items[1].column, thing.column);
    EXPECT_EQ(saved(again), saved(thing));
  }
}

TEST(Archive, NamesWhatDoesNotFit) {
  Thing longer;
  longer.column = {1, 2, 3, 4};
  EXPECT_EQ(refusal(saved(longer), Thing{}), "column: 4 numbers; allowed: 3");
  Thing nested;
  nested.items = {Thing{}, longer};
  EXPECT_EQ(refusal(saved(nested), Thing{}), "items.[1].column: 4 numbers; allowed: 3");
  Archive empty;
  EXPECT_EQ(refusal(empty.bytes(), Thing{}), "number: missing");
  EXPECT_EQ(refusal({1, 2, 3}, Thing{}), "not what an archive has saved, or not the whole of it");
  std::vector<std::uint8_t> half = saved(Thing{});
  half.resize(half.size() / 2);
  EXPECT_EQ(refusal(half, Thing{}), "not what an archive has saved, or not the whole of it");
}

}  // namespace
}  // namespace train_derail::files
