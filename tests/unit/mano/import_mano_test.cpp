// embodyctl import-mano as its users run it: output, files and exit codes of the real program.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/mano/mano_file.hpp"
#include "tests/unit/mano/synthetic_files.hpp"

namespace embody::mano {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code{-1};
  std::string output;
  std::string errors;
};

class ImportMano : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "import-XXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder = name;
    std::ofstream(folder / "left.npz", std::ios::binary) << test::to_npz(test::synthetic_arrays(Side::kLeft, 71), true);
  }
  void TearDown() override { fs::remove_all(folder); }

  [[nodiscard]] std::string text_of(const char* file) const {
    std::ostringstream text;
    text << std::ifstream(folder / file).rdbuf();
    return text.str();
  }

  /// Runs in `folder` with only XDG_DATA_HOME set to `data`.
  [[nodiscard]] Outcome run(const std::string& arguments, const std::string& data = "") const {
    const std::string command = "cd " + folder.string() + " && env -i " +
                                (data.empty() ? "" : "XDG_DATA_HOME=" + data) +
                                " " EMBODY_BINARY_DIR "/embodyctl import-mano " + arguments + " >out 2>err";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of("out"), text_of("err")};
  }

  fs::path folder;
};

TEST_F(ImportMano, WritesTheHandWhereSubjectFilesFindItAndSaysSo) {
  const fs::path data = folder / "data home";
  const Outcome done = run("left.npz", "'" + data.string() + "'");
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  const std::string path = data / "embody/mano_left.json";
  const auto hand = load_hand(path);
  ASSERT_TRUE(hand) << hand.error().detail.c_str();
  EXPECT_EQ(hand->side, Side::kLeft);
  for (const std::string& part : {std::string("left hand"), std::string("778 vertices"), std::string("1538 triangles"),
                                  std::string("mm from wrist"), "model = \"" + path + "\""}) {
    EXPECT_NE(done.output.find(part), std::string::npos) << part << " is not in: " << done.output;
  }
}

TEST_F(ImportMano, AnswersProgramsInJson) {
  const Outcome done = run("left.npz --output sub/hand.json --json");
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  const auto answer = nlohmann::json::parse(done.output);
  EXPECT_EQ(answer["ok"], true);
  const auto& result = answer["result"];
  EXPECT_EQ(result["side"], "left");
  EXPECT_EQ(result["vertices"], 778);
  EXPECT_EQ(result["triangles"], 1538);
  EXPECT_NEAR(result["hand_length_m"].get<double>(), .19, .01);
  EXPECT_EQ(result["file"], fs::canonical(folder / "sub/hand.json").string());
}

TEST_F(ImportMano, ReadsItsOwnFileAgain) {
  ASSERT_EQ(run("left.npz --output a.json").exit_code, 0);
  ASSERT_EQ(run("a.json --output b.json").exit_code, 0);
  EXPECT_EQ(text_of("a.json"), text_of("b.json"));
}

TEST_F(ImportMano, KeepsAnExistingFileUnlessForced) {
  std::ofstream(folder / "a.json") << "precious";
  const Outcome refused = run("left.npz --output a.json");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.errors.find("--force"), std::string::npos) << refused.errors;
  EXPECT_EQ(text_of("a.json"), "precious");
  EXPECT_EQ(run("left.npz --output a.json --force").exit_code, 0);
  EXPECT_TRUE(load_model(folder / "a.json"));
}

TEST_F(ImportMano, FailsWithOneSentence) {
  std::ofstream(folder / "wrong.json") << R"({"v_template": [[1, 2]]})";
  const Outcome wrong = run("wrong.json --output a.json");
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_EQ(wrong.errors, "embodyctl: wrong.json: v_template has shape 1x2; expected 778x3\n");
  EXPECT_FALSE(fs::exists(folder / "a.json"));

  const Outcome program = run("wrong.json --json");
  EXPECT_EQ(program.exit_code, 1);
  EXPECT_EQ(nlohmann::json::parse(program.output)["ok"], false);

  const Outcome absent = run("absent.npz --output a.json");
  EXPECT_EQ(absent.exit_code, 1);
  EXPECT_NE(absent.errors.find("absent.npz"), std::string::npos);

  const Outcome homeless = run("left.npz");
  EXPECT_EQ(homeless.exit_code, 1);
  EXPECT_NE(homeless.errors.find("--output"), std::string::npos);
  EXPECT_EQ(run("").exit_code, 2);
}

}  // namespace
}  // namespace embody::mano
