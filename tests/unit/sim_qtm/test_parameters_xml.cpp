#include "drivers/sim/qtm/parameters_xml.hpp"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include "drivers/sim/qtm/command_words.hpp"

namespace embody::sim {
namespace {

QtmSetup setup() {
  QtmSetup setup;
  setup.rate_hz = 100.0;
  setup.axis = "+Z";
  setup.labels = {"hand_top", "a & <b> \"c\"", "Table - 1"};
  setup.bodies = {{"hand", {{"hand_top", {0.001, 0.0, -0.002}}, {"x", {}}, {"y", {}}}}};
  return setup;
}

/// The text for `sections`, parsed; the root is its first child.
class Parameters {
 public:
  Parameters(const std::string& sections, int minor, const QtmSetup& qtm = setup()) {
    const auto xml = parameters_xml(command_words("GetParameters " + sections), qtm, minor);
    EXPECT_TRUE(xml.has_value()) << sections << " in 1." << minor;
    text = xml.value_or("<none/>");
    EXPECT_EQ(document_.Parse(text.c_str()), tinyxml2::XML_SUCCESS) << text;
    root = document_.RootElement();
  }
  const tinyxml2::XMLElement* at(std::initializer_list<const char*> path) const {
    const auto* element = root;
    for (const char* name : path) {
      if (element != nullptr) element = element->FirstChildElement(name);
    }
    return element;
  }
  std::string value(std::initializer_list<const char*> path) const {
    const auto* element = at(path);
    if (element == nullptr) ADD_FAILURE() << "no " << *(path.end() - 1);
    const char* found = element == nullptr ? nullptr : element->GetText();
    return found == nullptr ? "" : found;
  }
  std::string text;
  const tinyxml2::XMLElement* root{nullptr};

 private:
  tinyxml2::XMLDocument document_;
};

TEST(ParametersXml, IsWellFormedInEveryVersionAndNamesItInTwoDigits) {
  for (int minor = kOldestMinorVersion; minor <= kNewestMinorVersion; ++minor) {
    const Parameters parameters("All", minor);
    char name[40];
    std::snprintf(name, sizeof name, "QTM_Parameters_Ver_1.%02d", minor);
    EXPECT_STREQ(parameters.root->Name(), name);
    EXPECT_NE(parameters.at({"General"}), nullptr);
    EXPECT_NE(parameters.at({"The_3D"}), nullptr);
    EXPECT_NE(parameters.at({"The_6D"}), nullptr);
    EXPECT_EQ(parameters.at({"calibration"}) != nullptr, minor >= 21);
    EXPECT_EQ(parameters.at({"Skeletons"}) != nullptr, minor >= 19);
    EXPECT_TRUE(parameters.text.ends_with(">\r\n"));
  }
}

TEST(ParametersXml, GeneralHoldsWhatTheOfficialClientInsistsOn) {
  const Parameters parameters("General", 28);
  EXPECT_EQ(parameters.value({"General", "Frequency"}), "100");
  EXPECT_EQ(parameters.value({"General", "Capture_Time"}), "10.000000");
  for (const char* name :
       {"Start_On_External_Trigger", "Start_On_Trigger_NO", "Start_On_Trigger_NC", "Start_On_Trigger_Software"}) {
    EXPECT_EQ(parameters.value({"General", name}), "false");
  }
  for (const char* name :
       {"Enabled", "Signal_Source", "Signal_Mode", "Frequency_Multiplier", "Frequency_Divisor", "Frequency_Tolerance",
        "Nominal_Frequency", "Signal_Edge", "Signal_Shutter_Delay", "Non_Periodic_Timeout"}) {
    EXPECT_FALSE(parameters.value({"General", "External_Time_Base", name}).empty()) << name;
  }
  for (const char* set : {"Processing_Actions", "RealTime_Processing_Actions", "Reprocessing_Actions"}) {
    EXPECT_EQ(parameters.value({"General", set, "Tracking"}), "3D");
    EXPECT_EQ(parameters.value({"General", set, "AIM"}), "true");
    EXPECT_EQ(parameters.value({"General", set, "Track6DOF"}), "true");
  }
  EXPECT_EQ(parameters.at({"General", "RealTime_Processing_Actions", "ExportTSV"}), nullptr);
  EXPECT_STREQ(parameters.at({"General", "EulerAngles"})->Attribute("Second"), "Pitch");
}

TEST(ParametersXml, ListsTheLabelsInOrderAndEscapesTheirNames) {
  for (const int minor : {8, 21, 22, 28}) {
    const Parameters parameters("3D", minor);
    EXPECT_EQ(parameters.value({"The_3D", "AxisUpwards"}), "+Z");
    EXPECT_EQ(parameters.value({"The_3D", "CalibrationTime"}), "2021-08-26 14:02:11");
    EXPECT_EQ(parameters.value({"The_3D", "Labels"}), "3");
    std::vector<std::string> names;
    for (const auto* label = parameters.at({"The_3D", "Label"}); label != nullptr;
         label = label->NextSiblingElement("Label")) {
      names.emplace_back(label->FirstChildElement("Name")->GetText());
      EXPECT_EQ(label->FirstChildElement("Trajectory_Type") != nullptr, minor >= 22);
      EXPECT_NE(label->FirstChildElement("RGBColor"), nullptr);
    }
    EXPECT_EQ(names, setup().labels);
  }
}

TEST(ParametersXml, SaysThatNothingIsCalibrated) {
  QtmSetup uncalibrated = setup();
  uncalibrated.calibrated = false;
  const Parameters parameters("3D Calibration", 25, uncalibrated);
  EXPECT_EQ(parameters.value({"The_3D", "CalibrationTime"}), "");
  EXPECT_STREQ(parameters.at({"calibration"})->Attribute("calibrated"), "false");
}

TEST(ParametersXml, DescribesBodiesWithAttributesFrom1_21On) {
  for (const int minor : {21, 24, 28}) {
    const Parameters parameters("6D", minor);
    const auto* body = parameters.at({"The_6D", "Body"});
    ASSERT_NE(body, nullptr);
    for (const char* name : {"Name", "Color", "MaximumResidual", "MinimumMarkersInBody", "BoneLengthTolerance",
                             "Filter", "Points", "Data_origin", "Data_orientation"}) {
      EXPECT_NE(body->FirstChildElement(name), nullptr) << name;
    }
    EXPECT_EQ(body->FirstChildElement("Enabled") != nullptr, minor >= 24);
    const auto* point = body->FirstChildElement("Points")->FirstChildElement("Point");
    EXPECT_STREQ(point->Attribute("X"), "1.000000");
    EXPECT_STREQ(point->Attribute("Z"), "-2.000000");
    EXPECT_STREQ(point->Attribute("Name"), "hand_top");
    EXPECT_STREQ(body->FirstChildElement("Data_origin")->Attribute("Relative_body"),
                 body->FirstChildElement("Data_orientation")->Attribute("Relative_body"));
  }
}

TEST(ParametersXml, DescribesBodiesWithElementsBefore1_21) {
  const Parameters parameters("6D", 20);
  EXPECT_EQ(parameters.value({"The_6D", "Bodies"}), "1");
  EXPECT_EQ(parameters.value({"The_6D", "Body", "Name"}), "hand");
  EXPECT_EQ(parameters.value({"The_6D", "Body", "Point", "Z"}), "-2.000000");
  EXPECT_EQ(parameters.value({"The_6D", "Euler", "First"}), "Roll");
  QtmSetup none = setup();
  none.bodies.clear();
  EXPECT_EQ(Parameters("6D", 20, none).value({"The_6D", "Bodies"}), "0");
}

TEST(ParametersXml, KnowsTheSectionsOfEachVersionAndNoOthers) {
  const auto known = [](const std::string& section, int minor) {
    return parameters_xml(command_words("GetParameters " + section), setup(), minor).has_value();
  };
  for (const char* section : {"general", "3D", "6d", "Analog", "Force", "Image"}) EXPECT_TRUE(known(section, 8));
  EXPECT_TRUE(known("Skeleton:global", 19));
  EXPECT_FALSE(known("Skeleton", 18));
  EXPECT_FALSE(known("Calibration", 20));
  EXPECT_FALSE(known("EyeTracker", 20));
  for (const char* wrong : {"", "5D", "All 5D", "3D,6D", "Skeleton:local"}) EXPECT_FALSE(known(wrong, 28)) << wrong;
  EXPECT_EQ(Parameters("3D 3d 3D", 25).text, Parameters("3D", 25).text);
}

}  // namespace
}  // namespace embody::sim
