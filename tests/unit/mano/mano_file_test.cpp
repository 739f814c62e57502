#include "drivers/mano/mano_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/unit/mano/synthetic_files.hpp"

namespace embody::mano {
namespace {

namespace fs = std::filesystem;

class ManoFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "mano-XXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { fs::remove_all(folder); }

  void write(const std::string& path, std::string_view bytes) { std::ofstream(path, std::ios::binary) << bytes; }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  fs::path folder;
  ManoModel model = *make_model(test::synthetic_arrays(Side::kLeft, 51));
};

TEST_F(ManoFile, SavesAndLoadsTheSameHand) {
  const std::string path = folder / "deep/er/mano_left.json";
  const auto saved = save_model(model, path, false);
  ASSERT_TRUE(saved) << saved.error().detail.c_str();
  const auto hand = load_hand(path);
  ASSERT_TRUE(hand) << hand.error().detail.c_str();
  const hand::HandData expected = hand_data(model, path);
  EXPECT_EQ(hand->side, Side::kLeft);
  EXPECT_EQ(hand->source, path);
  EXPECT_FALSE(hand->skeleton.has_value());
  EXPECT_TRUE(hand->joints_M == expected.joints_M);
  EXPECT_TRUE(hand->joint_directions == expected.joint_directions);
  EXPECT_TRUE(hand->mesh.vertices_M == expected.mesh.vertices_M);
  EXPECT_TRUE(hand->mesh.pose_correctives == expected.mesh.pose_correctives);
}

TEST_F(ManoFile, ReplacesAFileOnlyWhenAskedTo) {
  const std::string path = folder / "mine.json";
  write(path, "precious");
  const auto refused = save_model(model, path, false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::kRefused);
  EXPECT_NE(std::string(refused.error().detail.view()).find("--force"), std::string::npos);
  EXPECT_EQ(fs::file_size(path), 8U);
  EXPECT_EQ(files(), 1U) << "nothing is left behind";
  EXPECT_TRUE(save_model(model, path, true));
  EXPECT_TRUE(load_model(path));
  EXPECT_EQ(files(), 1U) << "nothing is left behind";
}

TEST_F(ManoFile, NamesTheFileInEveryError) {
  const auto refusal = [](const std::string& path, Errc code) {
    const auto result = load_model(path);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, code);
    const std::string text(result.error().detail.view());
    EXPECT_NE(
        text.find(path.substr(std::max(path.rfind('/') + 1, path.size() - std::min<std::size_t>(path.size(), 60)))),
        std::string::npos)
        << text;
  };
  refusal(folder / "absent.npz", Errc::kNotFound);
  ::mkfifo((folder / "pipe.npz").c_str(), 0600);
  refusal(folder / "pipe.npz", Errc::kInvalidArgument);
  fs::create_directory(folder / "folder.npz");
  refusal(folder / "folder.npz", Errc::kInvalidArgument);
  write(folder / "MANO_RIGHT.pkl", "\x80\x02}q\x01.");
  refusal(folder / "MANO_RIGHT.pkl", Errc::kUnsupported);
  write(folder / "huge.json", "{");
  fs::resize_file(folder / "huge.json", kMaxFileBytes + 1);
  refusal(folder / "huge.json", Errc::kUnsupported);
  write(folder / (std::string(120, 'a') + ".json"), "{}");
  refusal(folder / (std::string(120, 'a') + ".json"), Errc::kMalformed);
}

TEST_F(ManoFile, SaysWhyItCannotBeWritten) {
  write(folder / "file", "x");
  const auto result = save_model(model, folder / "file/mano.json", false);
  ASSERT_FALSE(result);
  EXPECT_NE(std::string(result.error().detail.view()).find("mano.json"), std::string::npos);
}

}  // namespace
}  // namespace embody::mano
