// The file format: what is written is read again, and what breaks the format is refused with its line.
#include <random>

#include "tests/unit/capture/support.hpp"

namespace embody::capture {
namespace {

using test::bytes;

constexpr unsigned kSeed = 20;

Capture random_capture(std::mt19937& random, std::size_t count) {
  const auto below = [&](std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random); };
  Capture capture;
  capture.header = {static_cast<LinkKind>(below(3)), "2026-01-31T12:00:00Z", "a \"quoted\" pe\xc3\xa9r\n", "test"};
  std::vector<bool> open;
  std::int64_t t_ns = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Chunk chunk;
    chunk.t_ns = t_ns += static_cast<std::int64_t>(below(1'000'000));
    const std::size_t connection = open.empty() ? 0 : below(open.size() + 1);
    if (connection == open.size()) {
      open.push_back(true);
      chunk.event = Event::kOpen;
      chunk.port = static_cast<std::uint16_t>(below(65'536));
    } else if (!open[connection]) {
      continue;
    } else if (below(10) == 0) {
      open[connection] = false;
      chunk.event = Event::kClose;
      chunk.reset = true;
      chunk.by = static_cast<End>(below(2));
    } else {
      chunk.event = below(2) == 0 ? Event::kIn : Event::kOut;
      for (std::size_t k = 1 + below(40); k > 0; --k) chunk.bytes.push_back(static_cast<std::byte>(below(256)));
    }
    chunk.connection = static_cast<std::uint32_t>(connection + 1);
    capture.chunks.push_back(std::move(chunk));
  }
  return capture;
}

std::string refusal(const std::string& text) {
  const auto capture = parse_capture(text);
  return capture ? "accepted" : std::string(capture.error().detail.view());
}

const std::string kHeader = R"({"format":"embody-capture","version":1,"utc":"","link":"qtm","peer":"","program":""})"
                            "\n";
const std::string kOpen = R"({"t_ns":5,"conn":1,"dir":"open","port":1})"
                          "\n";

TEST(CaptureText, WhatIsWrittenIsReadAgain) {
  std::mt19937 random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const Capture capture = random_capture(random, 60);
    const auto again = parse_capture(capture_text(capture));
    ASSERT_TRUE(again.ok()) << again.error().detail.view();
    EXPECT_EQ(again->chunks, capture.chunks) << "seed " << kSeed << ", capture " << i;
    EXPECT_EQ(again->header.peer, capture.header.peer);
    EXPECT_EQ(again->header.link, capture.header.link);
  }
}

TEST(CaptureText, AFileThatEndsWithinALineIsRefusedWithTheNumberOfThatLine) {
  std::mt19937 random(kSeed);
  const std::string text = capture_text(random_capture(random, 12));
  for (std::size_t size = 0; size < text.size(); ++size) {
    const std::string part = text.substr(0, size);
    const auto lines = static_cast<std::size_t>(std::count(part.begin(), part.end(), '\n'));
    if (size > 0 && part.back() == '\n') {
      EXPECT_EQ(refusal(part), "accepted") << size;
    } else {
      EXPECT_NE(refusal(part).find("line " + std::to_string(lines + 1) + ": "), std::string::npos) << refusal(part);
    }
  }
}

TEST(CaptureText, AnyChangedByteIsReadOrRefusedWithASentence) {
  std::mt19937 random(kSeed);
  const std::string text = capture_text(random_capture(random, 6));
  std::size_t refused = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    for (const char c : {'\0', '"', '}', '\n', '9', 'f', '\xff'}) {
      std::string changed = text;
      changed[at] = c;
      const auto capture = parse_capture(changed);
      if (capture) continue;
      ++refused;
      ASSERT_TRUE(capture.error().detail.view().starts_with("line ")) << capture.error().detail.view();
    }
  }
  EXPECT_GT(refused, 3 * text.size());
}

struct Refusal {
  const char* line;
  const char* words;
};

class ChunkLine : public testing::TestWithParam<Refusal> {};

TEST_P(ChunkLine, IsRefused) {
  const std::string why = refusal(kHeader + kOpen + GetParam().line + "\n");
  EXPECT_NE(why.find("line 3: "), std::string::npos) << why;
  EXPECT_NE(why.find(GetParam().words), std::string::npos) << why;
}

INSTANTIATE_TEST_SUITE_P(
    Malformed, ChunkLine,
    testing::Values(Refusal{"", "no JSON"}, Refusal{"[]", "no JSON object"}, Refusal{"{}", "\"t_ns\" is missing"},
                    Refusal{R"({"t_ns":4,"conn":1,"dir":"in","hex":"00"})", "goes back"},
                    Refusal{R"({"t_ns":-1,"conn":1,"dir":"in","hex":"00"})", "\"t_ns\" is not a whole number"},
                    Refusal{R"({"t_ns":1.5,"conn":1,"dir":"in","hex":"00"})", "\"t_ns\" is not a whole number"},
                    Refusal{R"({"t_ns":18446744073709551615,"conn":1,"dir":"in","hex":"00"})", "\"t_ns\" is not"},
                    Refusal{R"({"t_ns":5,"conn":2,"dir":"in","hex":"00"})", "never opened"},
                    Refusal{R"({"t_ns":5,"conn":0,"dir":"in","hex":"00"})", "\"conn\" is not a whole number"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"up","hex":"00"})", "\"dir\" is none of in, out, open, close"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":"0"})", "half a byte"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":"0G"})", "something else"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":""})", "empty"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":7})", "\"hex\" is not a text"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":"00","x":1})", "does not belong"},
                    Refusal{R"({"t_ns":5,"t_ns":5,"conn":1,"dir":"in","hex":"00"})", "twice"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"in","hex":{"a":1}})", "nested"},
                    Refusal{R"({"t_ns":5,"conn":3,"dir":"open","port":1})", "must be 2"},
                    Refusal{R"({"t_ns":5,"conn":2,"dir":"open","port":65536})", "\"port\" is not"},
                    Refusal{R"({"t_ns":5,"conn":1,"dir":"close","by":"me","how":"end"})", "\"by\" is none of"}));

TEST(CaptureText, BytesOfAnEndThatHasClosedAreRefused) {
  const std::string in = R"({"t_ns":5,"conn":1,"dir":"in","hex":"00"})",
                    out = R"({"t_ns":5,"conn":1,"dir":"out","hex":"00"})";
  const std::string end = R"({"t_ns":5,"conn":1,"dir":"close","by":"device","how":"end"})";
  const std::string reset = R"({"t_ns":5,"conn":1,"dir":"close","by":"device","how":"reset"})";
  const std::string begin = kHeader + kOpen;
  EXPECT_EQ(refusal(begin + in + "\n" + end + "\n" + out + "\n"), "accepted");
  EXPECT_EQ(refusal(begin + end + "\n" + reset + "\n"), "accepted");
  EXPECT_NE(refusal(begin + end + "\n" + in + "\n").find("line 4: bytes of an end"), std::string::npos);
  EXPECT_NE(refusal(begin + reset + "\n" + out + "\n").find("line 4: bytes of an end"), std::string::npos);
  EXPECT_NE(refusal(begin + end + "\n" + end + "\n").find("line 4: this end"), std::string::npos);
  EXPECT_NE(refusal(begin + reset + "\n" + end + "\n").find("line 4: this end"), std::string::npos);
}

TEST(CaptureText, AnyHeaderThatIsWrittenIsRead) {
  std::mt19937 random(kSeed);
  for (int i = 0; i < 500; ++i) {
    Capture capture;
    for (std::size_t k = random() % 500; k > 0; --k) capture.header.peer += static_cast<char>(random());
    if (i % 2 == 0) capture.header.peer.clear();
    for (std::size_t k = random() % 300; k > 0; --k) capture.header.program += "\xc3\xa9";
    const auto again = parse_capture(capture_text(capture));
    ASSERT_TRUE(again.ok()) << again.error().detail.view();
    const bool fits = capture.header.program.size() <= kMaxHeaderText;
    EXPECT_EQ(again->header.program == capture.header.program, fits);
  }
}

TEST(CaptureText, AnotherVersionOrFormatIsNamed) {
  std::string newer = kHeader;
  newer.replace(newer.find("\"version\":1"), 11, "\"version\":2");
  EXPECT_EQ(refusal(newer), "line 1: this is version 2 of the format; this program reads version 1");
  std::string other = kHeader;
  other.replace(other.find("embody"), 6, "embedy");
  EXPECT_EQ(refusal(other), "line 1: \"format\" is not \"embody-capture\"");
  EXPECT_EQ(refusal(""), "line 1: the file is empty");
}

TEST(CaptureText, LinesAreBounded) {
  const std::string long_line = kHeader + kOpen + R"({"t_ns":5,"conn":1,"dir":"in","hex":")";
  EXPECT_NE(refusal(long_line + std::string(2 * kMaxChunkBytes + 2, '0') + "\"}\n").find("line 3"), std::string::npos);
  EXPECT_NE(refusal(long_line + std::string(10 * kMaxChunkBytes, '0') + "\"}\n").find("line 3: longer than"),
            std::string::npos);
  EXPECT_EQ(refusal(long_line + std::string(2 * kMaxChunkBytes, '0') + "\"}\n"), "accepted");
  EXPECT_NE(refusal(kHeader + std::string(100'000, '[') + "\n").find("line 2"), std::string::npos);
}

TEST(CaptureText, AMissingFileIsNamed) {
  const auto capture = load_capture("/nonexistent/x.jsonl");
  ASSERT_FALSE(capture.ok());
  EXPECT_EQ(capture.error().code, Errc::kNotFound);
  EXPECT_NE(capture.error().detail.view().find("/nonexistent/x.jsonl"), std::string_view::npos);
}

}  // namespace
}  // namespace embody::capture
