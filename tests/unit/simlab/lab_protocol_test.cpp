#include "daemon/simlab/lab_protocol.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace embody::sim {
namespace {

TEST(LabProtocol, WhatIsSentIsWhatArrives) {
  for (const auto command :
       {LabCommand::kStatus, LabCommand::kReport, LabCommand::kFaults, LabCommand::kFault, LabCommand::kPlay}) {
    LabRequest request;
    request.command = command;
    if (command == LabCommand::kFault) request.fault = "qtm hide \"Zeige\xc3\xbc \\ finger\"";
    request.id = 42;
    const std::string line = format_lab_request(request);
    ASSERT_EQ(line.find('\n'), line.size() - 1);
    const auto read = parse_lab_request(line.substr(0, line.size() - 1));
    ASSERT_TRUE(read.ok()) << read.error().detail.view();
    EXPECT_EQ(read->command, command);
    EXPECT_EQ(read->fault, request.fault);
    EXPECT_EQ(read->id, 42);
  }
}

TEST(LabProtocol, EverythingElseIsRefusedWithASentence) {
  const std::string long_fault(kMostFaultBytes + 1, 'x');
  for (const std::string& line : std::vector<std::string>{
           "", "play", "[]", "{}", R"({"command":"play"})", R"({"protocol":1})", R"({"protocol":1,"command":7})",
           R"({"protocol":1,"command":"engage"})", R"({"protocol":1,"command":"fault"})",
           R"({"protocol":1,"command":"fault","fault":""})", R"({"protocol":1,"command":"fault","fault":1})",
           R"({"protocol":1,"command":"play","fault":"qtm kill"})", R"({"protocol":1,"command":"play","x":1})",
           R"({"protocol":1,"command":"fault","fault":"qtm\nkill"})", R"({"protocol":1,"command":"play","id":"1"})",
           R"({"protocol":1,"command":"play","id":18446744073709551615})",
           R"({"protocol":1,"command":"fault","fault":")" + long_fault + "\"}"}) {
    const auto request = parse_lab_request(line);
    ASSERT_FALSE(request.ok()) << line;
    EXPECT_EQ(request.error().code, Errc::kMalformed) << line;
    EXPECT_FALSE(request.error().detail.empty());
  }
  EXPECT_EQ(parse_lab_request(R"({"protocol":2,"command":"play"})").error().code, Errc::kUnsupported);
  EXPECT_EQ(parse_lab_request(R"({"protocol":"1","command":"play"})").error().code, Errc::kUnsupported);
}

TEST(LabProtocol, TheDefaultSocketIsTheUsersOwn) {
  ::setenv("XDG_RUNTIME_DIR", "/run/user/1", 1);
  EXPECT_EQ(default_lab_socket(), "/run/user/1/embody/sim.sock");
  ::unsetenv("XDG_RUNTIME_DIR");
  EXPECT_EQ(default_lab_socket().find("/tmp/embody-"), 0U);
}

}  // namespace
}  // namespace embody::sim
