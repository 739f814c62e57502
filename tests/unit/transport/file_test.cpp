// Files are read with a bound and written whole or not at all; what is no file keeps its name.
#include "drivers/transport/file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <thread>

#include "drivers/transport/unique_fd.hpp"

namespace embody::transport {
namespace {

namespace fs = std::filesystem;

class FileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/embody-file-XXXXXX";
    folder = ::mkdtemp(name);
  }
  void TearDown() override { fs::remove_all(folder); }
  [[nodiscard]] std::string path(const std::string& name) const { return folder / name; }
  [[nodiscard]] static std::string content(const std::string& path) {
    const auto text = load_text(path, 100, "a test file");
    return text ? *text : std::string(text.error().detail.view());
  }
  [[nodiscard]] long entries() const { return std::distance(fs::directory_iterator(folder), fs::directory_iterator()); }

  fs::path folder;
};

TEST_F(FileTest, SavesWhatItLoads) {
  const std::string text("a\0b\n", 4);
  ASSERT_TRUE(save_text(text, path("new"), false));
  EXPECT_EQ(content(path("new")), text);
  ASSERT_TRUE(save_text("", path("empty"), false));
  EXPECT_EQ(content(path("empty")), "");
  EXPECT_EQ(entries(), 2) << "nothing else is left behind";
}

TEST_F(FileTest, ReplacesOnlyWhenAskedTo) {
  ASSERT_TRUE(save_text("mine", path("file"), false));
  EXPECT_EQ(check_output(path("file"), false).error().code, Errc::kRefused);
  EXPECT_EQ(save_text("other", path("file"), false).error().code, Errc::kRefused);
  EXPECT_EQ(content(path("file")), "mine");
  EXPECT_TRUE(save_text("other", path("file"), true));
  EXPECT_EQ(content(path("file")), "other");
  EXPECT_EQ(entries(), 1);
}

TEST_F(FileTest, WritesThroughASymbolicLink) {
  fs::create_directory(folder / "deep");
  fs::create_symlink("deep/target", folder / "link");
  EXPECT_EQ(save_text("x", path("link"), false).error().code, Errc::kRefused) << "the link exists";
  ASSERT_TRUE(save_text("first", path("link"), true)) << "its target does not exist yet";
  ASSERT_TRUE(save_text("second", path("link"), true));
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(content(path("deep/target")), "second");
}

TEST_F(FileTest, WritesIntoAPipeAndLeavesItAPipe) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::array<char, 16> got{};
  std::thread reader([&] {
    const UniqueFd fd(::open(path("pipe").c_str(), O_RDONLY | O_CLOEXEC));
    EXPECT_EQ(::read(fd.get(), got.data(), got.size()), 5);
  });
  EXPECT_TRUE(save_text("bytes", path("pipe"), false)) << "writing into a pipe replaces nothing";
  reader.join();
  EXPECT_STREQ(got.data(), "bytes");
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  EXPECT_TRUE(save_text("gone", "/dev/null", false));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(FileTest, SaysBeforeAndWhileWritingWhyItCannot) {
  ASSERT_TRUE(save_text("x", path("file"), false));
  struct Case {
    std::string path;
    Errc code;
  };
  for (const Case& c : {Case{"", Errc::kInvalidArgument},
                        {folder, Errc::kInvalidArgument},
                        {path("none/file"), Errc::kNotFound},
                        {path("file/below"), Errc::kNotFound}}) {
    const Status before = check_output(c.path, true);
    const Status then = save_text("x", c.path, true);
    ASSERT_FALSE(before.ok()) << c.path;
    ASSERT_FALSE(then.ok()) << c.path;
    EXPECT_EQ(before.error().code, c.code) << c.path;
    EXPECT_EQ(then.error().code, c.code) << c.path;
  }
  EXPECT_EQ(entries(), 1);
}

TEST_F(FileTest, LoadsNothingThatIsTooLongOrNoFile) {
  ASSERT_TRUE(save_text(std::string(100, 'x'), path("longest"), false));
  EXPECT_EQ(content(path("longest")).size(), 100U);
  ASSERT_TRUE(save_text(std::string(101, 'x'), path("longer"), false));
  EXPECT_EQ(load_text(path("longer"), 100, "short").error().code, Errc::kUnsupported);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(load_text(path("pipe"), 100, "a file").error().code, Errc::kInvalidArgument) << "and does not wait";
  EXPECT_EQ(load_text(folder, 100, "a file").error().code, Errc::kInvalidArgument);
  const auto absent = load_text(path("absent"), 100, "a file");
  EXPECT_EQ(absent.error().code, Errc::kNotFound);
  EXPECT_NE(absent.error().detail.view().find("absent"), std::string_view::npos);
}

}  // namespace
}  // namespace embody::transport
