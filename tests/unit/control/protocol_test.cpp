#include "daemon/control/protocol.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace embody::control {
namespace {

constexpr std::array kAll{Command::kStatus, Command::kEngage,   Command::kDisengage, Command::kStop,
                          Command::kReset,  Command::kShutdown, Command::kSubscribe, Command::kMarkers};

std::string refusal_of(std::string_view line) {
  const auto request = parse_request(line);
  return request.ok() ? "accepted" : std::string(request.error().detail.view());
}

TEST(Protocol, EveryRequestSurvivesTheWire) {
  for (const Command command : kAll) {
    Request request;
    request.command = command;
    request.id = -7;
    request.interval = std::chrono::milliseconds(250);
    const std::string line = format_request(request);
    ASSERT_EQ(line.find('\n'), line.size() - 1);
    const auto again = parse_request(std::string_view(line).substr(0, line.size() - 1));
    ASSERT_TRUE(again.ok()) << line << again.error().detail.view();
    EXPECT_EQ(again->command, command);
    EXPECT_EQ(again->id, request.id);
    EXPECT_EQ(again->interval, command == Command::kSubscribe ? request.interval : Request{}.interval);
  }
}

TEST(Protocol, WhatIsNoRequestIsRefusedWithAReason) {
  EXPECT_EQ(refusal_of("hello"), "a request is one JSON object on one line");
  EXPECT_EQ(refusal_of(""), "a request is one JSON object on one line");
  EXPECT_EQ(refusal_of("[1]"), "a request is one JSON object on one line");
  EXPECT_EQ(refusal_of("{\"protocol\":1}"), "member 'command' is missing");
  EXPECT_EQ(refusal_of("{\"command\":\"stop\"}"), "member 'protocol' is missing");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":\"engag\"}"), "unknown command 'engag'");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":7}"), "command must be text");
  EXPECT_EQ(refusal_of("{\"protocol\":1.0,\"command\":\"stop\"}"), "protocol must be a whole number");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":\"stop\",\"now\":true}"), "unknown member 'now'");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":\"stop\",\"id\":18446744073709551615}"),
            "id must be a whole number of 64 bits");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":\"stop\",\"interval_ms\":100}"),
            "interval_ms belongs to subscribe");
  EXPECT_EQ(refusal_of("{\"protocol\":1,\"command\":\"subscribe\",\"interval_ms\":1}"),
            "interval_ms must be a whole number from 20 to 60000");
}

TEST(Protocol, AnotherVersionIsRefusedAsSuchWhateverElseTheMessageHas) {
  const auto request = parse_request("{\"protocol\":2,\"command\":\"dance\",\"tempo\":3}");
  ASSERT_FALSE(request.ok());
  EXPECT_EQ(request.error().code, Errc::kUnsupported);
}

TEST(Protocol, WhatAClientWroteComesBackPrintable) {
  const std::string text = refusal_of("{\"protocol\":1,\"command\":\"\\u001b[2J\\n\"}");
  for (const char c : text) EXPECT_GE(c, 0x20) << text;
}

TEST(Protocol, ResponsesSurviveTheWireOnOneLine) {
  const std::string line = format_response({true, "{\"z\":1,\n \"a\":[2,\"x\\ny\"]}", "", ""}, 5);
  EXPECT_EQ(line, "{\"protocol\":1,\"ok\":true,\"id\":5,\"result\":{\"z\":1,\"a\":[2,\"x\\ny\"]}}\n");
  const auto done = parse_response(line);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->result, "{\"z\":1,\"a\":[2,\"x\\ny\"]}") << "the daemon's order stays";
  const auto refused = parse_response(format_response(refusal(code::kRefused, "not \"now\""), {}));
  ASSERT_TRUE(refused.ok());
  EXPECT_FALSE(refused->ok);
  EXPECT_EQ(refused->code, "refused");
  EXPECT_EQ(refused->message, "not \"now\"");
}

TEST(Protocol, ABrokenResultOrTextBecomesAValidResponse) {
  for (const char* result : {"", "{", "7", "{\"a\":}"}) {
    const auto response = parse_response(format_response({true, result, "", ""}, {}));
    ASSERT_TRUE(response.ok()) << result;
    EXPECT_FALSE(response->ok) << result;
  }
  EXPECT_TRUE(parse_response(format_response(refusal("failed", "bad \xff text"), {})).ok());
}

TEST(Protocol, AnAnswerOfSomethingElseIsAnError) {
  for (const char* line : {"", "HTTP/1.1 400 Bad Request", "{}", "{\"ok\":1}", "{\"ok\":true}", "{\"ok\":false}"}) {
    EXPECT_FALSE(parse_response(line).ok()) << line;
  }
}

TEST(Protocol, DamagedRequestsNeverCrashAndOftenAreRefused) {
  const std::string good = "{\"protocol\":1,\"command\":\"subscribe\",\"id\":3,\"interval_ms\":1000}";
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string line = good;
    for (auto changes = 1 + random() % 3; changes > 0; --changes) {
      line[random() % line.size()] = static_cast<char>(random() % 256);
    }
    if (!parse_request(line).ok()) ++refused;
  }
  EXPECT_GT(refused, 15'000);
}

TEST(Protocol, DeepNestingAndManyMembersAreCheap) {
  EXPECT_FALSE(parse_request(std::string(kMaxLineBytes, '[')).ok());
  std::string many = "{";
  for (int i = 0; many.size() < kMaxLineBytes - 20; ++i) many += "\"" + std::to_string(i) + "\":0,";
  EXPECT_FALSE(parse_request(many + "\"protocol\":1}").ok());
}

}  // namespace
}  // namespace embody::control
