#include "drivers/ur_rtde/codec.hpp"

#include <gtest/gtest.h>

#include <random>

#include "drivers/ur_rtde/frame_buffer.hpp"
#include "tests/unit/ur_rtde/hex.hpp"

namespace embody::rtde {
namespace {

using test::hex;
using Package = std::vector<std::byte>;

/// Payload of a package that must be complete and of the given type.
Bytes payload_of(const Package& package, PackageType type) {
  const ParsedFrame parsed = parse_frame(package);
  EXPECT_EQ(parsed.framing, Framing::kComplete);
  EXPECT_EQ(parsed.size, package.size());
  EXPECT_TRUE(parsed.frame.is(type));
  return parsed.frame.payload;
}

// The expected bytes are those that the vendor's controller and clients exchange.
TEST(RtdeGoldenFrames, ProtocolVersionBothWays) {
  const Package request = hex("00 05 56 00 02");
  EXPECT_EQ(encode_protocol_request(2), request);
  EXPECT_EQ(decode_protocol_request(payload_of(request, PackageType::kProtocolVersion)), 2);
  const Package reply = hex("00 04 56 01");
  EXPECT_EQ(encode_accepted(PackageType::kProtocolVersion, true), reply);
  EXPECT_EQ(decode_accepted(payload_of(reply, PackageType::kProtocolVersion)), true);
  EXPECT_EQ(decode_accepted(payload_of(hex("00 04 56 00"), PackageType::kProtocolVersion)), false);
}

TEST(RtdeGoldenFrames, ControllerVersionBothWays) {
  EXPECT_EQ(encode_request(PackageType::kControllerVersion), hex("00 03 76"));
  const Package reply = hex("00 13 76 00000005 00000008 00000000 00000000");
  EXPECT_EQ(encode_controller_version({5, 8, 0, 0}), reply);
  const auto version = decode_controller_version(payload_of(reply, PackageType::kControllerVersion));
  ASSERT_TRUE(version);
  EXPECT_EQ(version->major, 5U);
  EXPECT_EQ(version->minor, 8U);
}

TEST(RtdeGoldenFrames, OutputRecipeBothWays) {
  const Package request = hex("00 1d 4f 407f400000000000 'timestamp,actual_q'");
  ASSERT_EQ(request.size(), 29U);
  EXPECT_EQ(encode_outputs_request(500.0, "timestamp,actual_q"), request);
  const auto decoded = decode_outputs_request(payload_of(request, PackageType::kSetupOutputs));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->frequency_hz, 500.0);
  EXPECT_EQ(decoded->names, "timestamp,actual_q");
  const Package reply = hex("00 13 4f 01 'DOUBLE,VECTOR6D'");
  EXPECT_EQ(encode_setup_reply(PackageType::kSetupOutputs, {1, "DOUBLE,VECTOR6D"}), reply);
  const auto types = decode_setup_reply(payload_of(reply, PackageType::kSetupOutputs));
  ASSERT_TRUE(types);
  EXPECT_EQ(types->recipe, 1);
  EXPECT_EQ(types->types, "DOUBLE,VECTOR6D");
  EXPECT_EQ(encode_setup_reply(PackageType::kSetupOutputs, {0, "DOUBLE,NOT_FOUND"}),
            hex("00 14 4f 00 'DOUBLE,NOT_FOUND'"));
}

TEST(RtdeGoldenFrames, VersionOneHasNoFrequencyAndNoRecipeId) {
  const Package request = encode_outputs_request_v1("timestamp,actual_q");
  EXPECT_EQ(request, hex("00 15 4f 'timestamp,actual_q'"));
  EXPECT_EQ(as_text(payload_of(request, PackageType::kSetupOutputs)), "timestamp,actual_q");
  EXPECT_EQ(encode_outputs_reply_v1("DOUBLE,VECTOR6D"), hex("00 12 4f 'DOUBLE,VECTOR6D'"));
}

TEST(RtdeGoldenFrames, InputRecipeBothWays) {
  const Package request = hex("00 31 49 'input_int_register_24,input_double_register_24'");
  EXPECT_EQ(encode_inputs_request("input_int_register_24,input_double_register_24"), request);
  EXPECT_EQ(as_text(payload_of(request, PackageType::kSetupInputs)), "input_int_register_24,input_double_register_24");
  EXPECT_EQ(encode_setup_reply(PackageType::kSetupInputs, {1, "INT32,DOUBLE"}), hex("00 10 49 01 'INT32,DOUBLE'"));
  EXPECT_EQ(encode_setup_reply(PackageType::kSetupInputs, {0, "IN_USE,DOUBLE"}), hex("00 11 49 00 'IN_USE,DOUBLE'"));
}

TEST(RtdeGoldenFrames, StartAndPauseBothWays) {
  EXPECT_EQ(encode_request(PackageType::kStart), hex("00 03 53"));
  EXPECT_EQ(encode_request(PackageType::kPause), hex("00 03 50"));
  EXPECT_EQ(encode_accepted(PackageType::kStart, true), hex("00 04 53 01"));
  EXPECT_EQ(encode_accepted(PackageType::kPause, true), hex("00 04 50 01"));
}

TEST(RtdeGoldenFrames, TextsBothWays) {
  const Package package = hex("00 09 4d 02 'hi' 01 'd' 03");
  EXPECT_EQ(encode_text({"hi", "d", 3}), package);
  const auto text = decode_text(payload_of(package, PackageType::kText));
  ASSERT_TRUE(text);
  EXPECT_EQ(text->message, "hi");
  EXPECT_EQ(text->source, "d");
  EXPECT_EQ(text->level, 3);
  const Package old = hex("00 06 4d 03 'hi'");
  EXPECT_EQ(encode_text_v1({"hi", {}, 3}), old);
  const auto old_text = decode_text_v1(payload_of(old, PackageType::kText));
  ASSERT_TRUE(old_text);
  EXPECT_EQ(old_text->message, "hi");
  EXPECT_EQ(old_text->level, 3);
}

TEST(RtdeGoldenFrames, InputDataBothWays) {
  constexpr std::array<Variable, 2> kRecipe{
      {{"input_int_register_24", DataType::kInt32}, {"input_double_register_24", DataType::kDouble}}};
  const Package golden = hex("00 10 55 01 00000007 bff8000000000000");
  Package package(kFieldsStart + fields_size(kRecipe));
  begin_data(package, 1);
  store(package, kFieldsStart, std::int32_t{7});
  store(package, kFieldsStart + offset_of(kRecipe, "input_double_register_24", DataType::kDouble), -1.5);
  EXPECT_EQ(package, golden);
  const auto fields = decode_data(payload_of(golden, PackageType::kData), 1, fields_size(kRecipe));
  ASSERT_TRUE(fields);
  EXPECT_EQ(load<std::int32_t>(*fields, 0), 7);
  EXPECT_EQ(load<double>(*fields, 4), -1.5);
}

TEST(RtdeGoldenFrames, OutputDataBothWays) {
  constexpr std::array<Variable, 2> kRecipe{{{"timestamp", DataType::kDouble}, {"actual_q", DataType::kVector6d}}};
  const Package golden =
      hex("00 3c 55 01 40590020c49ba5e3 0000000000000000 bff8000000000000 3ff8000000000000 0000000000000000 "
          "3ff4000000000000 0000000000000000");
  Package package(kFieldsStart + fields_size(kRecipe));
  begin_data(package, 1);
  const std::array<double, 7> values{100.002, 0.0, -1.5, 1.5, 0.0, 1.25, 0.0};
  for (std::size_t i = 0; i < values.size(); ++i) store(package, kFieldsStart + 8 * i, values[i]);
  EXPECT_EQ(package, golden);
  const auto fields = decode_data(payload_of(golden, PackageType::kData), 1, fields_size(kRecipe));
  ASSERT_TRUE(fields);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(load<double>(*fields, 8 * i), values[i]);
}

TEST(RtdeGoldenFrames, DataOfARealRobot) {
  const Package golden = hex("00 14 55 01 40d0070d2f1a9fbe 3ff0000000000000");
  const auto fields = decode_data(payload_of(golden, PackageType::kData), 1, 16);
  ASSERT_TRUE(fields);
  EXPECT_NEAR(load<double>(*fields, 0), 16412.206, 1e-9);
  EXPECT_EQ(load<double>(*fields, 8), 1.0);
}

TEST(RtdeWire, EveryTypeNameIsReadBackAndHasTheSizeOfTheGuide) {
  constexpr std::array<std::size_t, 10> kSizes{1, 1, 4, 4, 8, 8, 24, 48, 24, 24};
  for (std::size_t i = 0; i < kSizes.size(); ++i) {
    const auto type = static_cast<DataType>(i);
    EXPECT_EQ(parse_type(type_name(type)), type);
    EXPECT_EQ(wire_size(type), kSizes[i]);
  }
  EXPECT_FALSE(parse_type("UNKNOWN"));
  EXPECT_FALSE(parse_type(""));
}

TEST(RtdeWire, LoadUndoesStoreForAnyBits) {
  std::mt19937_64 random(3);
  std::array<std::byte, 11> bytes{};
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t value = random();
    store(bytes, 3, value);
    ASSERT_EQ(load<std::uint64_t>(bytes, 3), value);
    store(bytes, 1, static_cast<std::int32_t>(value));
    ASSERT_EQ(load<std::int32_t>(bytes, 1), static_cast<std::int32_t>(value));
    store(bytes, 2, std::bit_cast<double>(value));
    ASSERT_EQ(std::bit_cast<std::uint64_t>(load<double>(bytes, 2)), value);
  }
}

TEST(RtdeWire, ATrailingCommaAddsNoName) {
  std::string_view list = "a,b,";
  std::string_view token;
  std::vector<std::string> tokens;
  while (next_token(list, token)) tokens.emplace_back(token);
  EXPECT_EQ(tokens, (std::vector<std::string>{"a", "b"}));
}

class RtdeSetupReply : public testing::Test {
 protected:
  static constexpr std::array<Variable, 2> kRecipe{{{"one", DataType::kInt32}, {"two", DataType::kDouble}}};
  static Errc verdict(std::uint8_t id, std::string_view types) {
    const Status status = check_setup_reply(kRecipe, {id, types});
    return status ? Errc::kIo : status.error().code;  // kIo is not used by the function
  }
};

TEST_F(RtdeSetupReply, AcceptsExactlyTheExpectedTypes) {
  EXPECT_TRUE(check_setup_reply(kRecipe, {1, "INT32,DOUBLE"}));
  EXPECT_TRUE(check_setup_reply(kRecipe, {7, "INT32,DOUBLE,"}));
  EXPECT_EQ(verdict(1, "INT32"), Errc::kMalformed);
  EXPECT_EQ(verdict(1, "INT32,DOUBLE,DOUBLE"), Errc::kMalformed);
  EXPECT_EQ(verdict(1, "UINT32,DOUBLE"), Errc::kMalformed);
  EXPECT_EQ(verdict(1, ""), Errc::kMalformed);
  EXPECT_EQ(verdict(0, "INT32,DOUBLE"), Errc::kMalformed);
}

TEST_F(RtdeSetupReply, NamesTheVariableThatIsMissingOrOwnedBySomebodyElse) {
  const Status missing = check_setup_reply(kRecipe, {0, "INT32,NOT_FOUND"});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::kNotFound);
  EXPECT_NE(missing.error().detail.view().find("two"), std::string_view::npos) << missing.error().detail.c_str();
  const Status in_use = check_setup_reply(kRecipe, {0, "IN_USE,DOUBLE"});
  ASSERT_FALSE(in_use);
  EXPECT_EQ(in_use.error().code, Errc::kRefused);
  EXPECT_NE(in_use.error().detail.view().find("one"), std::string_view::npos);
  EXPECT_NE(in_use.error().detail.view().find("fieldbus"), std::string_view::npos);
  EXPECT_NE(in_use.error().detail.view().find("client"), std::string_view::npos);
}

TEST(RtdeCodec, TextsLongerThanTheirLengthByteAreCut) {
  const std::string text(1000, 'x');
  const Package package = encode_text({text, text, 0});
  const auto decoded = decode_text(payload_of(package, PackageType::kText));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->message.size(), 255U);
  const Package names = encode_inputs_request(std::string(100'000, 'n'));
  EXPECT_EQ(names.size(), kMaxPackageSize);
  EXPECT_EQ(payload_of(names, PackageType::kSetupInputs).size(), kMaxPackageSize - kHeaderSize);
}

TEST(RtdeCodec, PayloadsOfAWrongSizeAreRefused) {
  const Package bytes(300);
  for (std::size_t size = 0; size < 40; ++size) {
    const Bytes payload = Bytes(bytes).first(size);
    EXPECT_EQ(decode_accepted(payload).has_value(), size == 1);
    EXPECT_EQ(decode_protocol_request(payload).has_value(), size == 2);
    EXPECT_EQ(decode_controller_version(payload).has_value(), size == 16);
    EXPECT_EQ(decode_outputs_request(payload).has_value(), size >= 8);
    EXPECT_EQ(decode_text(payload).has_value(), size == 3);  // two empty texts and a level
    EXPECT_EQ(decode_data(payload, 0, 20).has_value(), size == 21);
  }
}

/// A set-up with a text in between, then data: what a controller sends.
Package session_bytes() {
  using test::operator+;
  return hex("00 04 56 01") + hex("00 13 76 00000005 00000008 00000000 00000000") + hex("00 09 4d 02 'hi' 01 'd' 03") +
         hex("00 13 4f 01 'DOUBLE,VECTOR6D'") + hex("00 10 49 01 'INT32,DOUBLE'") + hex("00 04 53 01") +
         hex("00 14 55 01 40d0070d2f1a9fbe 3ff0000000000000") + hex("00 03 53") +
         hex("00 14 55 01 40d0070d2f1a9fbf 3ff0000000000000");
}

/// Types and payloads of all packages, as one printable text.
void drain(FrameBuffer& buffer, std::string& seen) {
  for (ParsedFrame parsed = buffer.next(); parsed.framing == Framing::kComplete; parsed = buffer.next()) {
    seen += static_cast<char>(parsed.frame.type);
    seen += as_text(parsed.frame.payload);
    seen += '|';
  }
}

std::string parse_in_parts(const Package& bytes, const std::vector<std::size_t>& cuts) {
  FrameBuffer buffer;
  std::string seen;
  std::size_t begin = 0;
  for (const std::size_t end : cuts) {
    std::copy(bytes.begin() + static_cast<std::ptrdiff_t>(begin), bytes.begin() + static_cast<std::ptrdiff_t>(end),
              buffer.space().begin());
    buffer.commit(end - begin);
    drain(buffer, seen);
    begin = end;
  }
  return seen;
}

TEST(RtdeFrameBuffer, FindsTheSamePackagesWhereverTheStreamIsCut) {
  const Package bytes = session_bytes();
  const std::string whole = parse_in_parts(bytes, {bytes.size()});
  ASSERT_EQ(std::count(whole.begin(), whole.end(), '|'), 9);
  std::vector<std::size_t> single_bytes;
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    ASSERT_EQ(parse_in_parts(bytes, {cut, bytes.size()}), whole) << "cut at " << cut;
    single_bytes.push_back(cut);
  }
  EXPECT_EQ(parse_in_parts(bytes, single_bytes), whole);
}

TEST(RtdeFrameBuffer, TakesTheLargestPackageAndReportsBrokenFraming) {
  FrameBuffer buffer;
  const Package largest = encode_inputs_request(std::string(kMaxPackageSize, 'n'));
  for (int round = 0; round < 5; ++round) {  // each round starts somewhere else in the buffer
    ASSERT_GE(buffer.space().size(), kMaxPackageSize);
    std::copy(largest.begin(), largest.end(), buffer.space().begin());
    buffer.commit(largest.size());
    ASSERT_EQ(buffer.next().size, kMaxPackageSize);
    ASSERT_EQ(buffer.next().framing, Framing::kIncomplete);
  }
  for (const char* broken : {"00 00 56", "00 01 56", "00 02 56"}) {
    buffer.clear();
    const Package bytes = hex(broken);
    std::copy(bytes.begin(), bytes.end(), buffer.space().begin());
    buffer.commit(bytes.size());
    EXPECT_EQ(buffer.next().framing, Framing::kBroken);
  }
}

}  // namespace
}  // namespace embody::rtde
