#pragma once
/// The findings of `tactus doctor`, for people and for scripts.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tactus/reconstruct/doctor/rig_doctor.h"

namespace tactus {

struct DoctorReport {
  std::string rig;  ///< as it was named
  std::vector<Camera> given;
  Box3f workspace_m;
  Diagnosis diagnosis;
  std::vector<std::string> evidence;  ///< metric and other, a line each
  double seen_by_few = 0;             ///< share of the workspace that fewer than three cameras see
  std::string damage;                 ///< of the recording (FrameSource::damage); "": it is whole
};

nlohmann::json doctor_json(const DoctorReport& report);
/// Findings, evidence and verdict on standard output.
void print_doctor(const DoctorReport& report);
/// The rig from above and from the side, suspects marked, as SVG.
std::string rig_drawing(const DoctorReport& report);
/// All of it in one file that needs no other. @throws Error naming the path.
void write_doctor_html(const std::string& path, const DoctorReport& report);

}  // namespace tactus
