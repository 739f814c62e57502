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

std::string section_6d(const std::string& bodies) {
  return "<The_6D>\r\n" + bodies + "</The_6D>\r\n";
}

std::string body(const std::string& name, const std::string& more = "") {
  return "<Body>\r\n<Name>" + name + "</Name>\r\n" + more + "</Body>\r\n";
}

TEST(QualisysParameters, ReadsBodiesInOrderSince1Dot21) {
  const auto parameters = parse_parameters(
      document(section_3d("0", "") +
               section_6d(body(" hand ",
                               "<Enabled>true</Enabled><Points><Point X=\"0.0\" Name=\"hand - 1\"/></Points>"
                               "<Data_origin X=\"0\" Relative_body=\"1\">0</Data_origin>"
                               "<Data_orientation R11=\"1\">0</Data_orientation>") +
                          body("table", "<Enabled>false</Enabled><Data_origin>1</Data_origin>"))));
  ASSERT_TRUE(parameters.ok()) << parameters.error().detail.c_str();
  EXPECT_EQ(parameters->bodies, (std::vector<BodyParameters>{{"hand", true, false}, {"table", false, true}}));
}

TEST(QualisysParameters, ReadsBodiesAsBefore1Dot21) {
  const std::string points = "<RGBColor>65280</RGBColor><Point><X>0.0</X><Y>0.0</Y><Z>0.0</Z></Point>";
  const auto parameters = parse_parameters(
      document(section_3d("0", "") + section_6d("<Bodies>2</Bodies>\r\n" + body("hand", points) + body("table") +
                                                "<Euler><First>Pitch</First></Euler>")));
  ASSERT_TRUE(parameters.ok()) << parameters.error().detail.c_str();
  EXPECT_EQ(parameters->bodies, (std::vector<BodyParameters>{{"hand", true, false}, {"table", true, false}}));
  EXPECT_TRUE(parse_parameters(document(section_3d("0", "") + section_6d("<Bodies>0</Bodies>"))).ok());
}

TEST(QualisysParameters, RefusesBodiesThatAreNotUsable) {
  std::string many;
  for (std::size_t i = 0; i <= kMaxDataBodies; ++i) many += body("b" + std::to_string(i));
  for (const auto& bodies : {body("hand") + body("hand"), body(""), body(std::string(kMaxNameLength + 1, 'x')), many,
                             "<Bodies>2</Bodies>" + body("hand"), "<Bodies>x</Bodies>" + body("hand")}) {
    const auto parameters = parse_parameters(document(section_3d("0", "") + section_6d(bodies)));
    ASSERT_FALSE(parameters.ok()) << bodies;
    EXPECT_FALSE(parameters.error().detail.empty());
  }
}

TEST(QualisysParameters, ReadsWhatIsDoneWithEachFrame) {
  struct Case {
    const char* actions;
    RealTimeProcessing processing;
  };
  for (const auto& [actions, processing] :
       {Case{"", {true, true, true}}, Case{"<RealTime_Processing_Actions/>", {true, true, true}},
        Case{"<RealTime_Processing_Actions><Tracking>3D</Tracking><AIM>true</AIM><Track6DOF>false</Track6DOF>"
             "</RealTime_Processing_Actions>",
             {true, true, false}},
        Case{"<Processing_Actions><AIM>false</AIM></Processing_Actions><RealTime_Processing_Actions>"
             "<Tracking>2D</Tracking><AIM>false</AIM></RealTime_Processing_Actions>",
             {false, false, true}}}) {
    const auto parameters = parse_parameters(
        document("<General><Frequency>100</Frequency>" + std::string(actions) + "</General>" + section_3d("0", "")));
    ASSERT_TRUE(parameters.ok()) << actions;
    EXPECT_EQ(parameters->processing, processing) << actions;
  }
}

}  // namespace
}  // namespace embody::qualisys
