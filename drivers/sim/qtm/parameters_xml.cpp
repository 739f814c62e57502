#include "drivers/sim/qtm/parameters_xml.hpp"

#include <algorithm>
#include <array>

#include "drivers/sim/qtm/command_words.hpp"
#include "drivers/sim/qtm/xml_text.hpp"

namespace embody::sim {
namespace {

constexpr const char* kCalibrationTime = "2021-08-26 14:02:11";
constexpr int kNestedXml = 21;  // minor version of the 6D and skeleton texts with attributes
constexpr int kTrajectoryTypes = 22;
constexpr int kEnabledBodies = 24;

void put_actions(XmlText& xml, const char* name, bool realtime, bool has_bodies, int minor) {
  xml.open(name);
  const char* bodies = has_bodies ? "true" : "false";
  xml.element("PreProcessing2D", "false");
  xml.element("Tracking", "3D");
  if (!realtime) xml.element("TwinSystemMerge", "false");
  if (!realtime) xml.element("SplineFill", "false");
  xml.element("AIM", "true");
  xml.element("Track6DOF", bodies);
  xml.element("ForceData", "false");
  xml.element("GazeVector", "false");
  if (minor >= 19) xml.element("SkeletonSolve", "false");
  if (!realtime) {
    for (const char* step : {"ExportTSV", "ExportC3D", "ExportMatlabFile", "ExportAviFile"}) xml.element(step, "false");
  }
  xml.close(name);
}

void put_time_base(XmlText& xml) {
  constexpr std::array<std::pair<const char*, const char*>, 10> kTimeBase{{{"Enabled", "false"},
                                                                           {"Signal_Source", "Control port"},
                                                                           {"Signal_Mode", "Periodic"},
                                                                           {"Frequency_Multiplier", "1"},
                                                                           {"Frequency_Divisor", "1"},
                                                                           {"Frequency_Tolerance", "1000"},
                                                                           {"Nominal_Frequency", "None"},
                                                                           {"Signal_Edge", "Negative"},
                                                                           {"Signal_Shutter_Delay", "0"},
                                                                           {"Non_Periodic_Timeout", "10.000000"}}};
  xml.open("External_Time_Base");
  for (const auto& [name, value] : kTimeBase) xml.element(name, value);
  xml.close("External_Time_Base");
}

void put_external_timestamp(XmlText& xml) {
  xml.open("External_Timestamp");
  xml.element("Enabled", "false");
  xml.element("Type", "SMPTE");
  xml.element("Frequency", "0");
  xml.close("External_Timestamp");
}

void put_general(XmlText& xml, const QtmSetup& setup, int minor) {
  char rate[32];
  std::snprintf(rate, sizeof rate, "%g", setup.rate_hz);
  xml.open("General");
  xml.element("Frequency", rate);
  xml.element("Capture_Time", "10.000000");
  xml.element("Start_On_External_Trigger", "false");
  for (const char* trigger : {"Start_On_Trigger_NO", "Start_On_Trigger_NC"}) xml.element(trigger, "false");
  xml.element("Start_On_Trigger_Software", setup.start_on_trigger ? "true" : "false");
  put_time_base(xml);
  if (minor >= kNestedXml) put_external_timestamp(xml);
  put_actions(xml, "Processing_Actions", false, !setup.bodies.empty(), minor);
  put_actions(xml, "RealTime_Processing_Actions", true, !setup.bodies.empty(), minor);
  put_actions(xml, "Reprocessing_Actions", false, !setup.bodies.empty(), minor);
  if (minor >= kNestedXml) xml.empty("EulerAngles", {{"First", "Roll"}, {"Second", "Pitch"}, {"Third", "Yaw"}});
  xml.close("General");
}

void put_3d(XmlText& xml, const QtmSetup& setup, int minor) {
  xml.open("The_3D");
  xml.element("AxisUpwards", setup.axis);
  xml.element("CalibrationTime", setup.calibrated ? kCalibrationTime : "");
  xml.element("Labels", std::to_string(setup.labels.size()));
  for (const auto& label : setup.labels) {
    xml.open("Label");
    xml.element("Name", label);
    xml.element("RGBColor", "65280");
    if (minor >= kTrajectoryTypes) xml.element("Trajectory_Type", "Measured");
    xml.close("Label");
  }
  if (minor >= 13) xml.empty("Bones");
  xml.close("The_3D");
}

/// Position of a point in millimetres, as attributes.
void put_point(XmlText& xml, const BodyPoint& point, std::size_t number) {
  const Eigen::Vector3d p_mm = 1e3 * point.p_B;
  xml.empty("Point", {{"X", decimal(p_mm.x())},
                      {"Y", decimal(p_mm.y())},
                      {"Z", decimal(p_mm.z())},
                      {"Virtual", "0"},
                      {"PhysicalId", "0"},
                      {"Name", point.name.empty() ? std::to_string(number) : point.name}});
}

void put_new_body(XmlText& xml, const BodyParameters& body, int minor) {
  xml.open("Body");
  xml.element("Name", body.name);
  if (minor >= kEnabledBodies) xml.element("Enabled", "true");
  xml.empty("Color", {{"R", "0"}, {"G", "255"}, {"B", "0"}});
  xml.element("MaximumResidual", "10.000000");
  xml.element("MinimumMarkersInBody", "3");
  xml.element("BoneLengthTolerance", "5.000000");
  xml.empty("Filter", {{"Preset", "No filter"}});
  xml.open("Points");
  for (std::size_t i = 0; i < body.points.size(); ++i) put_point(xml, body.points[i], i + 1);
  xml.close("Points");
  const std::string zero = decimal(0.0);
  const std::string one = decimal(1.0);
  xml.element("Data_origin", "0", {{"X", zero}, {"Y", zero}, {"Z", zero}, {"Relative_body", "1"}});
  xml.element("Data_orientation", "0",
              {{"R11", one},
               {"R12", zero},
               {"R13", zero},
               {"R21", zero},
               {"R22", one},
               {"R23", zero},
               {"R31", zero},
               {"R32", zero},
               {"R33", one},
               {"Relative_body", "1"}});
  xml.close("Body");
}

void put_old_bodies(XmlText& xml, const QtmSetup& setup, int minor) {
  xml.element("Bodies", std::to_string(setup.bodies.size()));
  for (const auto& body : setup.bodies) {
    xml.open("Body");
    xml.element("Name", body.name);
    xml.element("RGBColor", "65280");
    for (const auto& point : body.points) {
      xml.open("Point");
      for (int axis = 0; axis < 3; ++axis) {
        constexpr const char* kAxes[] = {"X", "Y", "Z"};
        xml.element(kAxes[axis], decimal(1e3 * point.p_B[axis]));
      }
      if (minor >= 20) xml.element("Virtual", "0");
      if (minor >= 20) xml.element("PhysicalId", "0");
      xml.close("Point");
    }
    xml.close("Body");
  }
  if (minor < 16) return;
  xml.open("Euler");
  xml.element("First", "Roll");
  xml.element("Second", "Pitch");
  xml.element("Third", "Yaw");
  xml.close("Euler");
}

void put_6d(XmlText& xml, const QtmSetup& setup, int minor) {
  xml.open("The_6D");
  if (minor >= kNestedXml) {
    for (const auto& body : setup.bodies) put_new_body(xml, body, minor);
  } else {
    put_old_bodies(xml, setup, minor);
  }
  xml.close("The_6D");
}

void put_calibration(XmlText& xml, const QtmSetup& setup) {
  const char* calibrated = setup.calibrated ? "true" : "false";
  xml.open("calibration",
           {{"calibrated", calibrated},
            {"source", setup.calibrated ? "20210826_140211.qca" : ""},
            {"created", setup.calibrated ? std::string("Calibration carried out: ") + kCalibrationTime : ""},
            {"qtm-version", "2023.3 (build 13590)"},
            {"type", "regular"},
            {"wandLength", "601.100000"},
            {"maximumFrames", "1500"},
            {"shortArmEnd", "365.000000"},
            {"longArmEnd", "566.000000"},
            {"longArmMiddle", "200.000000"}});
  xml.empty("results", {{"std-dev", "0.612345"}, {"min-max-diff", "4.106443"}});
  xml.empty("cameras");
  xml.close("calibration");
}

/// Writes one section (name in lower case); false when QTM has none of that name.
bool put_section(XmlText& xml, std::string_view section, const QtmSetup& setup, int minor) {
  if (section == "general") return put_general(xml, setup, minor), true;
  if (section == "3d") return put_3d(xml, setup, minor), true;
  if (section == "6d") return put_6d(xml, setup, minor), true;
  if (section == "calibration" && minor >= kNestedXml) return put_calibration(xml, setup), true;
  struct Empty {
    std::string_view section;
    const char* element;
    int oldest;
  };
  constexpr std::array<Empty, 7> kEmpty{{{"analog", "Analog", 0},
                                         {"force", "Force", 0},
                                         {"image", "Image", 0},
                                         {"gazevector", "Gaze_Vector", 11},
                                         {"eyetracker", "Eye_Tracker", 21},
                                         {"skeleton", "Skeletons", 19},
                                         {"skeleton:global", "Skeletons", 19}}};
  const auto* found = std::find_if(kEmpty.begin(), kEmpty.end(), [&](const auto& e) { return e.section == section; });
  if (found == kEmpty.end() || found->oldest > minor) return false;
  xml.empty(found->element);
  return true;
}

std::string root_name(int minor) {
  char root[40];
  std::snprintf(root, sizeof root, "QTM_Parameters_Ver_1.%02d", minor);
  return root;
}

}  // namespace

std::optional<std::string> parameters_xml(const std::vector<std::string>& words, const QtmSetup& setup, int minor) {
  if (words.size() < 2) return {};
  const std::string root = root_name(minor);
  XmlText xml;
  xml.open(root.c_str());
  std::vector<std::string> sections;
  const auto add = [&sections](std::string section) {
    if (std::find(sections.begin(), sections.end(), section) == sections.end()) sections.push_back(std::move(section));
  };
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (lower_case(words[i]) != "all") {
      add(lower_case(words[i]));
      continue;
    }
    for (const char* section : {"general", "3d", "6d", "analog", "force", "image"}) add(section);
    if (minor >= 11) add("gazevector");
    if (minor >= 19) add("skeleton");
    if (minor >= kNestedXml) add("eyetracker");
    if (minor >= kNestedXml) add("calibration");
  }
  for (const auto& section : sections) {
    if (!put_section(xml, section, setup, minor)) return {};
  }
  xml.close(root.c_str());
  return xml.str();
}

std::string calibration_result_xml(const QtmSetup& setup, int minor) {
  const std::string root = root_name(minor);
  XmlText xml;
  xml.open(root.c_str());
  put_calibration(xml, setup);
  xml.close(root.c_str());
  return xml.str();
}

}  // namespace embody::sim
