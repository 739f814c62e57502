#include "tests/unit/hand/real_recording.hpp"

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

namespace embody::test {
namespace {

std::vector<std::string> columns(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, '\t');) out.push_back(field);
  return out;
}

}  // namespace

std::vector<MarkerFrame> read_recording(const char* path, const hand::GloveLayout& glove) {
  std::ifstream in(path);
  std::string line;
  std::vector<std::size_t> column(glove.names.size(), 0);
  while (std::getline(in, line) && line.rfind("Frame\t", 0) != 0) {
    if (line.rfind("MARKER_NAMES\t", 0) != 0) continue;
    if (line.back() == '\r') line.pop_back();
    const std::vector<std::string> names = columns(line);
    for (std::size_t slot = 0; slot < glove.names.size(); ++slot) {
      for (std::size_t i = 1; i < names.size(); ++i) {
        if (glove.names[slot].view() == names[i]) column[slot] = 2 + 3 * (i - 1);
      }
      if (column[slot] == 0) return {};
    }
  }
  std::vector<MarkerFrame> frames;
  while (std::getline(in, line)) {
    const std::vector<std::string> fields = columns(line);
    MarkerFrame frame;
    frame.frame_number = std::stoul(fields.at(0));
    frame.count = glove.names.size();
    for (std::size_t slot = 0; slot < frame.count; ++slot) {
      Marker& marker = frame.markers[slot];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        marker.p_W(static_cast<Eigen::Index>(axis)) = 1e-3 * std::stod(fields.at(column[slot] + axis));
      }
      marker.visible = marker.p_W.allFinite();
    }
    frames.push_back(frame);
  }
  return frames;
}

MarkerFrame first_real_frame() {
  constexpr double kPointsMetres[13][3] = {
      {.110406, .135075, .460584}, {.062382, .161390, .450921}, {.066512, .130409, .452779},
      {.141316, .248687, .391455}, {.112068, .229996, .401035}, {.225936, .199537, .481317},
      {.166580, .184360, .481888}, {.241221, .143006, .477943}, {.176320, .155042, .476936},
      {.234577, .117890, .460454}, {.175389, .115921, .464020}, {.207847, .092899, .433300},
      {.167965, .092001, .440684}};
  MarkerFrame frame;
  frame.frame_number = 1;
  frame.t_capture = TimePoint{std::chrono::milliseconds(10)};
  frame.t_arrival = TimePoint{std::chrono::milliseconds(14)};
  frame.count = 13;
  for (std::size_t slot = 0; slot < 13; ++slot) {
    frame.markers[slot] = {{kPointsMetres[slot][0], kPointsMetres[slot][1], kPointsMetres[slot][2]}, true};
  }
  return frame;
}

}  // namespace embody::test
