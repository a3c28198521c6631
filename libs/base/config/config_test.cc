#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <fstream>

#include "config/config_file.h"
#include "config/option_section.h"
#include "config/program_options.h"
#include "config/usage.h"
#include "core/option_check.h"
#include "testing/test_folder.h"

namespace skein::config_test {

struct Values {
  int max_features = 8192;
  double ratio = 0.8;
  std::string model = "SIMPLE_RADIAL";
  std::string form = "colmap";
  std::vector<double> mean;
  bool merge = true;
  int threads = 1;
};

void Bind(CLI::App& app, Values* values) {
  app.add_option("--max-features", values->max_features, "Most keypoints a photo");
  app.add_option("--ratio", values->ratio, "Lowe's");
  app.add_option("--camera-model", values->model, "COLMAP's");
  AddChoice(
      app, "local-ba", {"colmap", "paper"}, [values] { return values->form; },
      [values](const std::string& form) { values->form = form; }, "Form");
  app.add_option("--mean", values->mean, "Three means");
  AddSwitch(app, "merge", &values->merge, "Join submaps");
}

class Config : public testing::Test {
 protected:
  // The error of a config file's text; "" if there is none.
  std::string Apply(const std::string& text, std::vector<std::string> arguments = {}) {
    CLI::App app;
    Bind(app, &values_);
    app.add_option("--threads", values_.threads, "Of the host")->configurable(false);
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
    const auto file = ParseConfigFile(text, "my.toml");
    if (!file) return file.error();
    const Status status = ApplySection(*file, "mapper", &app);
    written_ = SectionText("mapper", &app, false);
    commented_ = SectionText("mapper", &app, true);
    return status.error();
  }

  Values values_;
  std::string written_;
  std::string commented_;
};

TEST_F(Config, TakesItsOwnSectionAndLeavesOthers) {
  EXPECT_EQ(Apply(R"(
    # comment
    [features]
    max_features = 1
    [mapper]
    max_features = 4096   # fewer
    ratio = 0.75
    camera_model = "OPENCV"
    local_ba = "paper"
    mean = [0.5, 0.25, 0]
    merge = false
  )"),
            "");
  EXPECT_EQ(values_.max_features, 4096);
  EXPECT_EQ(values_.ratio, 0.75);
  EXPECT_EQ(values_.model, "OPENCV");
  EXPECT_EQ(values_.form, "paper");
  EXPECT_EQ(values_.mean, (std::vector<double>{0.5, 0.25, 0}));
  EXPECT_FALSE(values_.merge);
}

TEST_F(Config, CommandLineGoesFirst) {
  EXPECT_EQ(Apply("[mapper]\nmax_features = 4096\nmerge = true\nratio = 0.7\n",
                  {"--max-features", "100", "--no-merge"}),
            "");
  EXPECT_EQ(values_.max_features, 100);
  EXPECT_FALSE(values_.merge);
  EXPECT_EQ(values_.ratio, 0.7);
}

TEST_F(Config, SaysWhichKeyOfWhichFileIsWrong) {
  EXPECT_EQ(Apply("[mapper]\nmax_featurs = 1\n"),
            "my.toml: [mapper] max_featurs: there is no such key; `skein config` prints all");
  for (const char* wrong : {"max_features = many", "max_features = [1, 2]", "local_ba = \"best\"",
                            "threads = 2", "ratio = 1\nmerge = true\nratio = 2"}) {
    const std::string error = Apply(std::string("[mapper]\n") + wrong + "\n");
    EXPECT_EQ(error.find("my.toml: [mapper] " + std::string(wrong, 4)), 0u)
        << wrong << ": " << error;
  }
}

TEST_F(Config, SaysWhatIsWrongWithTheFile) {
  EXPECT_NE(Apply("[maper]\nratio = 1\n").find("there is no section [maper]"), std::string::npos);
  EXPECT_NE(Apply("ratio = 1\n").find("outside all sections"), std::string::npos);
  EXPECT_NE(Apply("[mapper]\na.ratio = 1\n").find("without dots"), std::string::npos);
  EXPECT_NE(Apply("mapper.ratio = 1\n").find("without dots"), std::string::npos);
  EXPECT_NE(ReadConfigFile("/no/such/file.toml").error().find("/no/such/file.toml"),
            std::string::npos);
}

// CLI11 2.4, of Debian 13, throws for an escape sequence that it does not know.
TEST_F(Config, AnUnknownEscapeSequenceIsNoException) {
  EXPECT_NO_THROW((void)ParseConfigFile("[web]\nname = \"alic\\\"\n", "file"));
  EXPECT_NO_THROW((void)ParseConfigFile("[web]\nname = \"a\\q\"\n", "file"));
}

TEST_F(Config, WhatIsWrittenReadsBackTheSame) {
  ASSERT_EQ(Apply("[mapper]\nratio = 0.7\nmean = [1, 2, 3]\nmerge = false\n"), "");
  EXPECT_EQ(written_,
            "[mapper]\nmax_features = 8192\nratio = 0.7\ncamera_model = \"SIMPLE_RADIAL\"\n"
            "local_ba = \"colmap\"\nmean = [1,2,3]\nmerge = false\n");
  const std::string first = written_;
  values_ = Values();
  ASSERT_EQ(Apply(first), "");
  EXPECT_EQ(written_, first);
  values_ = Values();
  ASSERT_EQ(Apply(commented_), "");
  EXPECT_EQ(written_, first);
}

TEST_F(Config, DefaultsReadBackTheSame) {
  ASSERT_EQ(Apply(""), "");
  const std::string first = written_;
  EXPECT_NE(commented_.find("# Three means\n# mean =\n"), std::string::npos) << commented_;
  ASSERT_EQ(Apply(commented_), "");
  EXPECT_EQ(written_, first);
}

TEST_F(Config, EachTableOfAnArrayIsASectionOfItsOwn) {
  const auto file = ParseConfigFile(
      "[[cameras]]\nagent = \"a b\"\nparams = [1, 2]\n[[cameras]]\nagent = \"c,d\"\n", "my.toml");
  ASSERT_TRUE(file.ok()) << file.error();
  ASSERT_EQ(file->sections.size(), 2u);
  EXPECT_EQ(file->sections[0].entries[0].values, std::vector<std::string>{"a b"});
  EXPECT_EQ(file->sections[0].entries[1].values, (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(file->sections[1].entries[0].values, std::vector<std::string>{"c,d"});
}

class ProgramOptions : public testing::Test {
 protected:
  std::optional<int> Parse(std::vector<std::string> arguments) {
    Program program;
    program.section = "mapper";
    program.version = "1.2.3 (abc)";
    program.add_options = [this](CLI::App& app) { Bind(app, &values_); };
    program.check = [this] { return InRange("ratio", values_.ratio, 0.0, 1.0); };
    std::vector<char*> argv;
    arguments.insert(arguments.begin(), "skein-mapper");
    for (std::string& argument : arguments) argv.push_back(argument.data());
    return ParseProgramOptions(program, static_cast<int>(argv.size()), argv.data(),
                               &configuration_);
  }

  TestFolder folder_;
  Values values_;
  std::string configuration_;
};

TEST_F(ProgramOptions, ReadTheFileAndTellWhatTheyAre) {
  const std::string path = folder_.path() / "my.toml";
  std::ofstream(path) << "[mapper]\nratio = 0.5\n";
  EXPECT_EQ(Parse({"--config", path, "--max-features", "7"}), std::nullopt);
  EXPECT_EQ(values_.ratio, 0.5);
  EXPECT_NE(configuration_.find("max_features = 7\nratio = 0.5\n"), std::string::npos);
}

TEST_F(ProgramOptions, RefuseWithOneLine) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Parse({"--ratio", "1.5"}), 2);
  EXPECT_EQ(Parse({"--ratoi", "1"}), 2);
  EXPECT_EQ(Parse({"--config", "/no/such/file.toml"}), 2);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("skein-mapper: [mapper] ratio is 1.5: give 0 to 1\n"), std::string::npos);
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 3) << said;
}

TEST_F(ProgramOptions, RefuseNumbersThatAreNone) {
  const std::string path = folder_.path() / "my.toml";
  testing::internal::CaptureStderr();
  int num_lines = 0;
  for (const std::string number : {"nan", "-nan", "inf", "-inf", "infinity"}) {
    EXPECT_EQ(Parse({"--mean", "1", number, "3"}), 2) << number;
    std::ofstream(path) << "[mapper]\nmean = [1, " << number << ", 3]\n";
    EXPECT_EQ(Parse({"--config", path}), 2) << number;
    num_lines += 2;
  }
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("[mapper] --mean is nan: give a number\n"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), num_lines) << said;
  EXPECT_EQ(Parse({"--mean", "1", "2", "3", "--camera-model", "nan"}), std::nullopt) << "a name";
}

TEST_F(ProgramOptions, PrintTheVersionAndEnd) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(Parse({"--version"}), 0);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "skein-mapper 1.2.3 (abc)\n");
  EXPECT_EQ(Parse({}), std::nullopt);
  EXPECT_EQ(configuration_.find("version"), std::string::npos) << configuration_;
}

TEST_F(ProgramOptions, PrintTheSectionAndEnd) {
  testing::internal::CaptureStdout();
  EXPECT_EQ(Parse({"--print-config"}), 0);
  EXPECT_NE(testing::internal::GetCapturedStdout().find("# Lowe's\nratio = 0.8\n"),
            std::string::npos);
}

// What a user is told of the arguments; "" if they are taken.
std::string Refusal(std::vector<std::string> arguments) {
  CLI::App app("A program");
  std::string images, port;
  double rate = 0, within = 0;
  app.add_option("--images", images, "Folder")->required();
  app.add_option("--lcm-url", port, "URL");
  app.add_option("--rate", rate, "Photos a second")->check(AtLeastZero());
  app.add_option("--within", within, "Seconds")->check(AboveZero());
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return UsageError(app, error);
  }
  return "";
}

TEST(Usage, NamesTheUnknownOptionRatherThanTheOneThatItStandsFor) {
  EXPECT_EQ(Refusal({"--imges", "x"}), "there is no option --imges; do you mean --images?");
  EXPECT_EQ(Refusal({"--imges=x"}), "there is no option --imges; do you mean --images?");
  EXPECT_EQ(Refusal({"--images", "x", "--lcm", "y"}),
            "there is no option --lcm; do you mean --lcm-url?");
  EXPECT_EQ(Refusal({"--images", "x", "--port", "1"}), "there is no option --port");
  EXPECT_EQ(Refusal({}), "--images is required");
  EXPECT_EQ(Refusal({"--images", "x"}), "");
}

TEST(Usage, TellsOfANumberOnlyWhatMatters) {
  EXPECT_EQ(Refusal({"--images", "x", "--rate", "-1"}), "--rate: give 0 or more, not '-1'");
  EXPECT_EQ(Refusal({"--images", "x", "--rate", "fast"}), "--rate: give 0 or more, not 'fast'");
  EXPECT_EQ(Refusal({"--images", "x", "--within", "0"}), "--within: give more than 0, not '0'");
  EXPECT_EQ(Refusal({"--images", "x", "--within", "inf"}), "--within: give more than 0, not 'inf'");
  EXPECT_EQ(Refusal({"--images", "x", "--rate", "0", "--within", "0.5"}), "");
}

}  // namespace skein::config_test
