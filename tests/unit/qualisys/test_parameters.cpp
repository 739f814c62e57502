#include <gtest/gtest.h>

#include <string>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/parameters.hpp"

namespace embody::qualisys {
namespace {

std::string label(const std::string& name) {
  return "        <Label>\r\n            <Name>" + name +
         "</Name>\r\n            <RGBColor>65280</RGBColor>\r\n        </Label>\r\n";
}

std::string section_3d(const std::string& count, const std::string& labels) {
  return "    <The_3D>\r\n        <AxisUpwards>+Z</AxisUpwards>\r\n"
         "        <CalibrationTime>2021-08-26 14:02:11</CalibrationTime>\r\n        <Labels>" +
         count + "</Labels>\r\n" + labels + "        <Bones/>\r\n    </The_3D>\r\n";
}

std::string document(const std::string& sections, const std::string& root = "QTM_Parameters_Ver_1.25") {
  return "<" + root + ">\r\n" + sections + "</" + root + ">\r\n";
}

TEST(QualisysParameters, ReadsLabelsInOrderWithAxisCalibrationAndRate) {
  const auto parameters = parse_parameters(
      document("<General>\r\n<Frequency>100</Frequency></General>" +
               section_3d("3", label("hand_top") + label("Table - 1") + label(" a &amp; &lt;b&gt; "))));
  ASSERT_TRUE(parameters.ok()) << parameters.error().detail.c_str();
  EXPECT_EQ(parameters->frequency_hz, 100.0);
  EXPECT_EQ(parameters->axis_upwards, "+Z");
  EXPECT_EQ(parameters->calibration_time, "2021-08-26 14:02:11");
  EXPECT_EQ(parameters->labels, (std::vector<std::string>{"hand_top", "Table - 1", "a & <b>"}));
}

TEST(QualisysParameters, IgnoresTheNameOfTheRoot) {
  for (const char* root : {"QTM_Parameters_Ver_1.06", "QTM_Parameters_Ver_1.21", "Anything"}) {
    EXPECT_TRUE(parse_parameters(document(section_3d("0", ""), root)).ok()) << root;
  }
}

TEST(QualisysParameters, KeepsAnEmptyCalibrationTimeEmpty) {
  for (const char* empty :
       {"<CalibrationTime></CalibrationTime>", "<CalibrationTime/>", "<CalibrationTime> \r\n</CalibrationTime>", ""}) {
    const auto parameters = parse_parameters(document("<The_3D>" + std::string(empty) + "<Labels>0</Labels></The_3D>"));
    ASSERT_TRUE(parameters.ok()) << empty;
    EXPECT_EQ(parameters->calibration_time, "") << empty;
  }
}

TEST(QualisysParameters, RefusesTwoLabelsOfTheSameNameAndNamesIt) {
  const auto parameters = parse_parameters(document(section_3d("2", label("hand_top") + label(" hand_top "))));
  ASSERT_FALSE(parameters.ok());
  EXPECT_EQ(parameters.error().code, Errc::kRefused);
  EXPECT_NE(parameters.error().detail.view().find("'hand_top'"), std::string_view::npos);
}

TEST(QualisysParameters, RefusesWhatIsNotUsable) {
  const std::string deep = [] {
    std::string open;
    for (int i = 0; i < 200'000; ++i) open += "<a>";
    return open;
  }();
  std::string many;
  for (std::size_t i = 0; i <= kMaxDataMarkers; ++i) many += label("m" + std::to_string(i));
  const std::pair<const char*, std::string> cases[] = {
      {"empty", ""},
      {"not XML", "Parse error"},
      {"cut", document(section_3d("1", label("a"))).substr(0, 150)},
      {"no 3D section", document("<General><Frequency>100</Frequency></General>")},
      {"count too high", document(section_3d("2", label("a")))},
      {"count too low", document(section_3d("0", label("a")))},
      {"count no number", document(section_3d("one", label("a")))},
      {"name empty", document(section_3d("1", label(" ")))},
      {"name too long", document(section_3d("1", label(std::string(kMaxNameLength + 1, 'x'))))},
      {"too many labels", document(section_3d(std::to_string(kMaxDataMarkers + 1), many))},
      {"rate no number", document("<General><Frequency>fast</Frequency></General>" + section_3d("0", ""))},
      {"rate negative", document("<General><Frequency>-1</Frequency></General>" + section_3d("0", ""))},
      {"rate nan", document("<General><Frequency>nan</Frequency></General>" + section_3d("0", ""))},
      {"nested deeply", deep},
      {"too large", document(section_3d("0", std::string(kMaxParametersSize, ' ')))},
  };
  for (const auto& [what, xml] : cases) {
    const auto parameters = parse_parameters(xml);
    ASSERT_FALSE(parameters.ok()) << what;
    EXPECT_FALSE(parameters.error().detail.empty()) << what;
  }
}

TEST(QualisysParameters, RefusesEveryTruncation) {
  const auto xml = document(section_3d("2", label("a") + label("b")));
  const auto last_tag = xml.rfind('>');
  for (std::size_t size = 0; size <= last_tag; ++size) {
    EXPECT_FALSE(parse_parameters(std::string_view(xml).substr(0, size)).ok()) << "cut behind byte " << size;
  }
  EXPECT_TRUE(parse_parameters(xml).ok());
}

}  // namespace
}  // namespace embody::qualisys
