// YAML as this program takes it: the same train as roslaunch (PyYAML, YAML 1.1) sees, merge keys, and bounds on size
// and depth.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

const std::string kTrain =
    "consist: [{name: hopper, count: 3, length: 53 ft, weight: 286 kip}]\n"
    "initial: {speed: 30 mph, yaw_rate: 0.1}\n";

/// What is wrong with a scenario, or "" and its YAML.
std::string refusal(const std::string& text, std::string* yaml = nullptr) {
  try {
    const std::string read = inputs::to_yaml(inputs::read_scenario(inputs::load_text(text, "file"), "file"));
    if (yaml != nullptr) *yaml = read;
    return "";
  } catch (const inputs::InputError& e) {
    return e.what();
  }
}

std::string yaml_of(const std::string& text) {
  std::string yaml;
  EXPECT_EQ(refusal(text, &yaml), "") << text;
  return yaml;
}

TEST(Yaml, MergeKeysTakeWhatTheOwnKeysLeave) {
  const std::string plain =
      "consist:\n  - {name: hopper, count: 3, length: 53 ft, weight: 286 kip, truck_spacing: 40 ft}\n"
      "  - {name: hopper, count: 2, length: 53 ft, weight: 63 kip, truck_spacing: 40 ft}\n"
      "initial: {speed: 30 mph, yaw_rate: 0.1}\n";
  const std::string initial = "initial: {speed: 30 mph, yaw_rate: 0.1}\n";
  EXPECT_EQ(yaml_of("consist:\n  - &hopper\n    name: hopper\n    count: 3\n    length: 53 ft\n    weight: 286 kip\n   "
                    " truck_spacing: 40 ft\n"
                    "  - <<: *hopper\n    count: 2\n    weight: 63 kip\n" +
                    initial),
            yaml_of(plain));
  // Own keys win wherever they stand, and the first of several sources.
  EXPECT_EQ(
      yaml_of("consist:\n  - &hopper {name: hopper, count: 3, length: 53 ft, weight: 286 kip, truck_spacing: 40 ft}\n"
              "  - {weight: 63 kip, <<: [{count: 2}, *hopper], count: 2}\n" +
              initial),
      yaml_of(plain));
  // Through several files of anchors: a place for them, and a merge of what is merged itself.
  EXPECT_EQ(yaml_of("x-cars:\n  - &frame {length: 53 ft, truck_spacing: 40 ft}\n  - &hopper {<<: *frame, name: hopper, "
                    "count: 3, weight: 286 kip}\n"
                    "consist: [*hopper, {<<: *hopper, count: 2, weight: 63 kip}]\n" +
                    initial),
            yaml_of(plain));
}

TEST(Yaml, AChangedInputKeepsWhatIsMerged) {
  const YAML::Node tree = inputs::load_text(
      "x-p: &p {initial: {speed: 30 mph, yaw_rate: 0.1}, coupler: {slack: 0.1, length: 1.5}}\n<<: *p\n"
      "consist: [{count: 3, length: 53 ft, weight: 286 kip}]\n",
      "file");
  const inputs::Scenario s = inputs::read_scenario(tree, "file", {{"coupler.slack", "0.2"}});
  EXPECT_EQ(s.coupler.slack, 0.2);
  EXPECT_EQ(s.coupler.length, 1.5);
  EXPECT_EQ(inputs::read_scenario(tree, "file").coupler.slack, 0.1) << "the tree itself is not changed";
}

TEST(Yaml, WrongMergeKeysAreRefused) {
  EXPECT_EQ(refusal("<<: 5\n" + kTrain),
            "file:1: '<<': can merge only groups of keys; allowed: <<: *name or <<: [*one, *other]");
  EXPECT_EQ(refusal("<<: [{}, 5]\n" + kTrain),
            "file:1: '<<': can merge only groups of keys; allowed: <<: *name or <<: [*one, *other]");
  EXPECT_EQ(refusal("<<: {}\n<<: {}\n" + kTrain), "file:2: '<<': key given twice; allowed: once: <<: [*one, *other]");
  EXPECT_EQ(refusal("title: <<\n" + kTrain).substr(0, 85),
            "file:1: '<<': roslaunch (YAML 1.1) would read this as a merge key, not a value; allow");
  EXPECT_EQ(refusal("\"<<\": {}\n" + kTrain).substr(0, 31), "file:1: << = '{}': unknown key;")
      << "in quotes it is a name";
  EXPECT_EQ(refusal("initial: {speed: 1, speed: 2, <<: {yaw_rate: 1}}\nconsist: []\n"),
            "file:1: initial.speed = '2': key given twice; allowed: once")
      << "own keys are";
}

// PyYAML makes something else of them; each with and without the key that takes text.
TEST(Yaml, WhatRoslaunchReadsOtherwiseIsRefused) {
  for (const char* word : {"yes",
                           "No",
                           "on",
                           "OFF",
                           "True",
                           "FALSE",
                           "010",
                           "-017",
                           "0x1F",
                           "0b11",
                           "1_000",
                           "1_0.5",
                           "1:30",
                           "1:30.5",
                           "-1:30:00",
                           "2001-12-14",
                           "2001-12-14 21:59:43",
                           "2001-12-14t21:59:43.10-05:00",
                           "2147483648",
                           "-2147483649",
                           "99999999999999999999",
                           "=",
                           "-0",
                           "deg(5)",
                           "rad(pi/2)",
                           "._5",
                           "1_.5"}) {
    for (const std::string key : {"title", "coupler.length"}) {
      const std::string text =
          key == "title" ? "title: " + std::string(word) + "\n" + kTrain : kTrain + "coupler: {length: " + word + "}\n";
      const std::string problem = refusal(text);
      if (std::string(word) == "._5") continue;  // text for both
      EXPECT_NE(problem.find(std::string("'") + word + "': roslaunch (YAML 1.1) would read this as "),
                std::string::npos)
          << text << problem;
    }
    EXPECT_EQ(refusal("title: \"" + std::string(word) + "\"\n" + kTrain), "") << "in quotes it is text: " << word;
  }
}

TEST(Yaml, WhatRoslaunchReadsAsTheSameIsTaken) {
  for (const auto& [text, value] : {std::pair{"1e-0", 1.0},
                                    {"1.0e-0", 1.0},
                                    {"1.5e0", 1.5},
                                    {".5", 0.5},
                                    {"5.", 5.0},
                                    {"+1", 1.0},
                                    {"+1.5", 1.5},
                                    {"1", 1.0},
                                    {"08", 8.0},
                                    {"1.0e+0", 1.0},
                                    {"00.5", 0.5},
                                    {"'010'", 10.0},
                                    {"1 m", 1.0}}) {
    const auto s =
        inputs::read_scenario(inputs::load_text(kTrain + "coupler: {length: " + text + "}\n", "file"), "file");
    EXPECT_EQ(s.coupler.length, value) << text;
  }
  const auto forces = [](const std::string& text) {
    return inputs::read_scenario(inputs::load_text(kTrain + "coupler: {swing_moment_max: " + text + "}\n", "file"),
                                 "file")
        .coupler.swing_moment_max;
  };
  for (const char* text : {".inf", "+.inf", ".Inf", "\".inf\""}) EXPECT_EQ(forces(text), inputs::kInfinity) << text;
  EXPECT_EQ(inputs::read_scenario(inputs::load_text(kTrain + "solver: {steps_max: +7000000}\n", "file"), "file")
                .solver.steps_max,
            7000000);
}

TEST(Yaml, TextThatRoslaunchWouldWriteOtherwiseWantsQuotes) {
  for (const char* text : {"1.50", "+5", "1.0", ".inf", "1.0e+3"}) {
    EXPECT_EQ(refusal("title: " + std::string(text) + "\n" + kTrain),
              "file:1: title = '" + std::string(text) +
                  "': a number where a text is needed; roslaunch (YAML 1.1) would change its digits; allowed: \"" +
                  text + "\" in quotes");
    EXPECT_EQ(refusal("title: \"" + std::string(text) + "\"\n" + kTrain), "");
  }
  for (const char* text : {"2007", "-5", "1e5", "12 May 2007", "true", "Train no. 5"})
    EXPECT_EQ(refusal("title: " + std::string(text) + "\n" + kTrain), "") << text;
}

TEST(Yaml, WhatOneOfTheReadersRefusesIsRefused) {
  EXPECT_EQ(refusal(kTrain + "---\ntitle: other\n"),
            "file:3: a second YAML document begins here; allowed: one document, without a line ---");
  EXPECT_EQ(refusal("---\n" + kTrain + "...\n"), "");
  EXPECT_EQ(refusal("title: !!str 5\n" + kTrain).substr(0, 23), "file:1: '5': a tag (tag");
  for (const char* tagged :
       {"!!float 5", "!!int 5", "!!binary aGVsbG8=", "!!python/object:os.system x", "!mine x", "!<tag:x> y"}) {
    EXPECT_NE(refusal("title: " + std::string(tagged) + "\n" + kTrain).find(": a tag ("), std::string::npos) << tagged;
  }
  EXPECT_EQ(refusal(kTrain + "coupler: !!map {length: 1}\n").substr(0, 16), "file:3: a tag (t");
  EXPECT_EQ(refusal(kTrain + "coupler: !{length: 1}\n").substr(0, 16), "file:3: a tag (!");
  EXPECT_EQ(refusal(kTrain + "coupler:\n\tlength: 1\n"), "file:4: a tab; allowed: spaces; in quotes \\t");
  EXPECT_EQ(refusal(kTrain + "title: a\tb\n"), "file:3: a tab; allowed: spaces; in quotes \\t");
  EXPECT_EQ(refusal(kTrain + "title: x # a\ttab in a comment\n"), "");
  EXPECT_EQ(refusal(kTrain + "title: \x1b[31mred\n"),
            "file:3: a control character (U+001B); allowed: printable characters; in quotes \\x..");
  EXPECT_EQ(refusal(kTrain + "title: a\u0085b\n"),
            "file:3: a control character (U+0085); allowed: printable characters; in quotes \\x..");
  EXPECT_EQ(refusal(kTrain + "title: a\u2028b\n").substr(0, 36), "file:3: a control character (U+2028)");
  EXPECT_EQ(refusal(kTrain + "title: \xff\n"), "file:3: a byte that is not UTF-8 (0xff); allowed: text in UTF-8");
  EXPECT_EQ(refusal(kTrain + std::string("title: a\0b\n", 11)).substr(0, 36), "file:3: a control character (U+0000)");
  EXPECT_EQ(
      refusal("? [a, b]\n: 5\n" + kTrain),
      "file:1: [a, b] = '5': unknown key; allowed: brakes, consist, contact, coupler, ground, initial, model, "
      "obstacles, outcome, output, rails, release, solver, stop, suspension, terrain, ties, title, track, traction");
  EXPECT_EQ(refusal("title: ~\n" + kTrain), "file:1: title = 'nothing': the value is missing; allowed: text");
  EXPECT_EQ(refusal("title:\n" + kTrain), "file:1: title = 'nothing': the value is missing; allowed: text");
}

TEST(Yaml, LineEndsAndByteOrderMarksAreTheSameTrain) {
  const std::string plain = yaml_of(kTrain);
  std::string windows;
  for (const char c : kTrain) windows += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(yaml_of(windows), plain);
  EXPECT_EQ(yaml_of("\xef\xbb\xbf" + kTrain), plain);
}

TEST(Yaml, WhatIsWrittenCanBeReadByBoth) {
  inputs::Scenario s = inputs::read_scenario(inputs::load_text(kTrain, "file"), "file");
  s.initial.perturbation.spacing = 0.001;
  s.initial.perturbation.seed = 9007199254740992;
  s.title = "yes";
  std::string again;
  EXPECT_EQ(refusal(inputs::to_yaml(s), &again), "");
  EXPECT_EQ(again, inputs::to_yaml(s));
}

// Bounds: an end with one line, soon, and with the process alive.

std::string repeated(const std::string& part, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += part;
  return all;
}

TEST(YamlBounds, DeepTextsEndWithOneLine) {
  const std::string deep = "nested too deeply; allowed: at most 50 levels";
  for (const char* part : {"[", "{a: ", "- ", "? ", "[{a: "}) {
    const std::string problem = refusal(repeated(part, 100'000));
    EXPECT_TRUE(problem.find(deep) != std::string::npos) << part << problem;
  }
  std::string blocks;
  for (int i = 0; i < 300; ++i) blocks += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_NE(refusal(blocks).find(deep), std::string::npos);
  EXPECT_EQ(refusal("title: " + repeated("[", 49) + repeated("]", 49) + "\n").find(deep), std::string::npos);
  EXPECT_NE(refusal("title: " + repeated("[", 50) + repeated("]", 50) + "\n").find(deep), std::string::npos);
}

TEST(YamlBounds, AliasesCountAsWhatTheyStandFor) {
  std::string nests = "x:\n- &a0 [x]\n";  // 80,000 levels in 160 kB
  for (int i = 1; i < 200; ++i)
    nests +=
        "- &a" + std::to_string(i) + " " + repeated("[", 40) + "*a" + std::to_string(i - 1) + repeated("]", 40) + "\n";
  EXPECT_EQ(refusal(nests + "title: *a199\n"),
            "file:4: nested too deeply; allowed: at most 50 levels, with aliases expanded");
  std::string laughs = "x0: &x0 [a, a, a, a, a, a, a, a, a, a]\n";  // 10^10 values
  for (int i = 1; i < 10; ++i) {
    const std::string last = "*x" + std::to_string(i - 1);
    laughs += "x" + std::to_string(i) + ": &x" + std::to_string(i) + " [" + last + repeated(", " + last, 9) + "]\n";
  }
  EXPECT_EQ(refusal(laughs), "file:5: too many values; allowed: at most 50000, with aliases expanded");
  std::string merges = "x0: &x0 {a0: 1, b0: 1}\n";
  for (int i = 1; i < 40; ++i) merges += fmt::format("x{0}: &x{0} {{<<: [*x{1}, *x{1}], a{0}: 1}}\n", i, i - 1);
  EXPECT_NE(refusal(merges).find("too many values"), std::string::npos);
  EXPECT_EQ(refusal("x: &x [*x]\n"),
            "file:1: an alias inside the value that it stands for; allowed: anchors (&name) that end before their "
            "aliases (*name)");
}

TEST(YamlBounds, LongTextsAreRefusedByTheirSize) {
  EXPECT_EQ(refusal(std::string(600'000, '#')), "file: 600000 bytes long; allowed: at most 524288 bytes");
  EXPECT_NE(refusal("x: [" + repeated("1,", 100'000) + "]").find("too many values"), std::string::npos);
  const std::string thousand = "consist:\n" +
                               repeated(
                                   "  - {name: tank_car, count: 1, length: 18.123456789012345, width: 3.1, weight: "
                                   "1272190.1234567, truck_spacing: 12.1, "
                                   "yaw_inertia_factor: 0.0931234567, brake_share: 1.5, brake_source: remote}\n",
                                   1000) +
                               "initial: {speed: 30 mph, yaw_rate: 0.1}\nbrakes: {law: friction}\n";
  EXPECT_EQ(refusal(thousand), "") << "the longest train";
  EXPECT_EQ(refusal(yaml_of(thousand)), "");
}

TEST(YamlBounds, NothingButFilesIsRead) {
  const fs::path folder = fs::temp_directory_path() / ("train_derail_yaml_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const auto file_refusal = [](const fs::path& path) {
    try {
      inputs::load_file(path.string());
    } catch (const inputs::InputError& e) {
      return std::string(e.what()).substr(path.string().size());
    }
    return std::string();
  };
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(file_refusal(folder / "pipe"), ": cannot be read: a pipe; allowed: a file")
      << "without waiting for a writer";
  EXPECT_EQ(file_refusal("/dev/zero"), ": cannot be read: a device; allowed: a file");
  EXPECT_EQ(file_refusal("/dev/null"), ": cannot be read: a device; allowed: a file");
  EXPECT_EQ(file_refusal(folder), ": cannot be read: a folder; allowed: a file");
  EXPECT_EQ(file_refusal(folder / "none"), ": cannot be read: No such file or directory");
  EXPECT_EQ(file_refusal(std::string(5000, 'x')), ": cannot be read: File name too long");
  fs::create_symlink(folder / "loop", folder / "loop");
  EXPECT_EQ(file_refusal(folder / "loop"), ": cannot be read: Too many levels of symbolic links");
  { std::ofstream sparse(folder / "sparse"); }
  fs::resize_file(folder / "sparse", 1'000'000'000'000);
  EXPECT_EQ(file_refusal(folder / "sparse"), ": file too long; allowed: at most 524288 bytes");
  { std::ofstream(folder / "good") << kTrain; }
  EXPECT_EQ(file_refusal(folder / "good"), "");
  EXPECT_EQ(inputs::read_file((folder / "good").string(), kTrain.size()), kTrain);
  fs::remove_all(folder);
}

// What is wrong is shown, and shown as text alone.
TEST(Messages, AreOneLineWithoutEffectOnATerminal) {
  EXPECT_EQ(inputs::InputError("file", "k\ney", "\x1b[31mred\a\r\xff\u009b\u202e", "bad\x7f", "a\tb").what(),
            std::string("file: k\\ney = '\\x1b[31mred\\x07\\r\\xff\\u009b\\u202e': bad\\x7f; allowed: a\\tb"));
  const std::string cut =
      inputs::InputError("file", std::string(10'000, 'k'), std::string(10'000, 'v'), "bad", "").what();
  EXPECT_EQ(cut, "file: " + std::string(200, 'k') + "... = '" + std::string(200, 'v') + "...': bad");
  EXPECT_EQ(inputs::printable("Minot, \u00c4\u00f6 \U0001f682 \"quoted\""), "Minot, \u00c4\u00f6 \U0001f682 \"quoted\"")
      << "what can be seen stays";
  EXPECT_EQ(inputs::printable("\xc0\x80\xed\xa0\x80\xf5"), "\\xc0\\x80\\xed\\xa0\\x80\\xf5")
      << "no overlong forms, no halves of characters";
  EXPECT_EQ(refusal("title: \"\\e[31m\"\n" + kTrain),
            "file:1: title = '\\x1b[31m': a control character; allowed: printable text");
  EXPECT_EQ(refusal("title: " + std::string(2000, 'x') + "\n" + kTrain),
            "file:1: title = '" + std::string(200, 'x') + "...': 2000 bytes long; allowed: at most 1000");
}

}  // namespace
}  // namespace train_derail
