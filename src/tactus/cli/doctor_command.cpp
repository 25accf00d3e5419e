#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/output/doctor_report.h"
#include "tactus/cli/program.h"
#include "tactus/io/json_file.h"
#include "tactus/reconstruct/depth/depth_check.h"
#include "tactus/rig/data_writers.h"
#include "tactus/rig/metric_evidence.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/run/frame_sink.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

/// Not those of a failure (1) or of wrong usage (2).
constexpr int kExitFaulty = 4, kExitUnsure = 5;
constexpr double kScaleTolerance = 0.05;
constexpr int kTicks = 11;

struct DoctorOptions {
  std::string rig, source, json_path, html_path, fix_folder, board, timestamps;
  std::optional<int> frame;
  std::vector<std::string> distances, corners;
};

struct Distance {
  std::size_t a = 0, b = 0;
  double metres = 0;
};

/// Measurements besides silhouettes; `metric`: they settle the scale.
struct Evidence {
  std::vector<std::string> lines;
  std::vector<DoctorFinding> findings;
  bool metric = false;  ///< some of it has a length, and agrees
  bool depth = false;   ///< that of a depth camera, which knows the size of the object itself
};

SourceKind kind_of(const DoctorOptions& options) {
  if (!options.source.empty()) return source_kind(options.source);
  if (fs::is_directory(options.rig)) return SourceKind::middlebury;
  if (is_recording(options.rig)) return SourceKind::recording;
  const RigFile file = read_rig_file(options.rig);
  const auto lacking = [](const std::vector<std::string>& files) {
    return std::count(files.begin(), files.end(), "");
  };
  const auto without_mask = lacking(file.masks);
  // Where some have neither, the one that fewer cameras lack is named.
  const bool has_masks = without_mask < std::ssize(file.masks) && without_mask <= lacking(file.videos);
  return has_masks ? SourceKind::masks : SourceKind::videos;
}

std::size_t camera_number(const std::vector<Camera>& cameras, const std::string& name) {
  std::vector<std::string> names;
  for (const Camera& c : cameras) names.push_back(c.name);
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end())
    throw usage_error("camera '" + name + "' is not in the rig" + suggestion(name, names));
  return static_cast<std::size_t>(at - names.begin());
}

double metres_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(value > 0 && value < 1e6))
    throw usage_error("--distance: '" + text + "', expected metres above 0");
  return value;
}

std::vector<Distance> measured_distances(const DoctorOptions& options, const std::vector<Camera>& cameras) {
  std::vector<Distance> result;
  if (options.distances.size() % 3 != 0)
    throw usage_error("--distance takes two cameras and the metres between them: --distance cam1 cam3 2.83");
  for (std::size_t i = 0; i + 2 < options.distances.size(); i += 3)
    result.push_back({camera_number(cameras, options.distances[i]),
                      camera_number(cameras, options.distances[i + 1]), metres_of(options.distances[i + 2])});
  return result;
}

/// "8x6x0.115"
ClickedBoard board_of(const DoctorOptions& options) {
  ClickedBoard board;
  int used = 0;
  if (std::sscanf(options.board.c_str(), "%dx%dx%lf%n", &board.columns, &board.rows, &board.square_m,
                  &used) != 3 ||
      used != static_cast<int>(options.board.size()) || board.columns < 2 || board.rows < 2 ||
      !(board.square_m > 0))
    throw usage_error("--board '" + options.board +
                      "': expected inner corners and metres of a square, 8x6x0.115");
  return board;
}

/// Distances between cameras that all saw one board.
std::vector<Distance> board_distances(const DoctorOptions& options, const RigFile& file,
                                      std::vector<std::string>& lines) {
  std::vector<Distance> result;
  if (options.corners.empty()) return result;
  const ClickedBoard board = board_of(options);
  std::vector<std::pair<std::size_t, Vec3d>> centers;
  for (const std::string& entry : options.corners) {
    const std::size_t equals = entry.find('=');
    if (equals == std::string::npos) throw usage_error("--corners '" + entry + "': expected CAMERA=FILE");
    const std::size_t c = camera_number(file.rig.cameras, entry.substr(0, equals));
    const BoardPose pose =
        pose_from_board(file.calibrated[c], board,
                        read_clicked_corners(find_data(entry.substr(equals + 1), options.rig), board));
    char line[160];
    std::snprintf(line, sizeof line, "camera '%s': the board's corners fit to %.2f px",
                  file.rig.cameras[c].name.c_str(), pose.rms_px);
    lines.emplace_back(line);
    centers.emplace_back(c, pose.center_m);
  }
  for (std::size_t i = 0; i < centers.size(); ++i) {
    for (std::size_t k = i + 1; k < centers.size(); ++k)
      result.push_back({centers[i].first, centers[k].first, length(centers[i].second - centers[k].second)});
  }
  return result;
}

/// Compares calibrated distances with measured ones.
void weigh_distances(const std::vector<Distance>& distances, const std::vector<Camera>& cameras,
                     double mean_recall, Evidence& evidence) {
  if (distances.empty()) return;
  double least = 1e300, most = 0, product = 0;
  for (const Distance& d : distances) {
    const double calibrated = length(cameras[d.a].center_world() - cameras[d.b].center_world());
    const double ratio = calibrated / d.metres;
    least = std::min(least, ratio);
    most = std::max(most, ratio);
    product += std::log(ratio) / static_cast<double>(distances.size());
    char line[200];
    std::snprintf(line, sizeof line, "%s to %s: %.4g m by the calibration, %.4g m measured, ratio %.3f",
                  cameras[d.a].name.c_str(), cameras[d.b].name.c_str(), calibrated, d.metres, ratio);
    evidence.lines.emplace_back(line);
  }
  if (least >= 1 - kScaleTolerance && most <= 1 + kScaleTolerance) {
    evidence.metric = true;
    return;
  }
  const double scale = std::exp(product);
  const bool one_scale = most <= (1 + kScaleTolerance) * scale && least >= (1 - kScaleTolerance) * scale;
  char cure[240];
  if (one_scale)
    std::snprintf(cure, sizeof cure, "all distances are %.3f times too long: multiply unit_m by %.4g", scale,
                  1 / scale);
  else
    std::snprintf(
        cure, sizeof cure,
        "distances are %.2f to %.2f times the measured ones: no one scale cures it, calibrate again", least,
        most);
  evidence.findings.push_back({-1, -1, "distances between cameras", cure, mean_recall, mean_recall});
}

void weigh_depth(const FrameSource& source, const FrameSet& frame, double mean_recall, Evidence& evidence) {
  const Rig& rig = source.rig();
  for (std::size_t d = 0; d < rig.depth_cameras.size() && d < frame.depths_m.size(); ++d) {
    if (frame.depths_m[d].empty()) continue;
    const std::string odd = depth_inconsistency(rig.cameras, frame.silhouettes, rig.depth_cameras[d],
                                                frame.depths_m[d], rig.workspace_m);
    if (odd.empty()) {
      evidence.lines.push_back("depth of camera '" + rig.depth_cameras[d].name + "' agrees with the hull");
      evidence.metric = evidence.depth = true;
    } else {
      evidence.findings.push_back(
          {-1, -1, "depth contradicts the silhouettes", odd, mean_recall, mean_recall});
    }
  }
}

void weigh_times(const DoctorOptions& options, double mean_recall, Evidence& evidence) {
  if (options.timestamps.empty()) return;
  const FrameSkew skew = read_frame_skew(options.timestamps);
  char line[200];
  std::snprintf(line, sizeof line,
                "frames of a tick lie %.1f ms apart (median of %zu ticks), at most %.1f ms", skew.median_ms,
                skew.ticks, skew.largest_ms);
  evidence.lines.emplace_back(line);
  // At 1 m/s a millisecond is a millimetre: more than a few show in silhouettes.
  if (skew.largest_ms < 5) return;
  DoctorFinding finding{-1,
                        -1,
                        "not synchronised",
                        std::string(line) + ": trigger the cameras together, or film slow motion",
                        mean_recall,
                        mean_recall};
  evidence.findings.push_back(finding);
}

double seen_by_few(const std::vector<Camera>& cameras, const Box3f& box) {
  constexpr int n = 24;
  int few = 0;
  for (int k = 0; k < n * n * n; ++k) {
    const Vec3d e = vec_cast<double>(box.extent());
    const Vec3d p = vec_cast<double>(box.min) + Vec3d{(k % n + 0.5) / n * e.x, (k / n % n + 0.5) / n * e.y,
                                                      (k / (n * n) + 0.5) / n * e.z};
    int views = 0;
    for (const Camera& c : cameras) {
      const Pixel at = project(c, p);
      views += at.z_m > 0 && at.u_px >= -0.5 && at.v_px >= -0.5 && at.u_px < c.width_px - 0.5 &&
                       at.v_px < c.height_px - 0.5
                   ? 1
                   : 0;
    }
    few += views < 3 ? 1 : 0;
  }
  return static_cast<double>(few) / (n * n * n);
}

/// The cured rig as files that stand for themselves: pinholes, and the masks of the examined frame.
void write_fixed(const std::string& folder, const Diagnosis& d, const Box3f& workspace_m) {
  const FolderLock lock(folder);
  fs::create_directories(fs::path(folder) / "cameras");
  fs::create_directories(fs::path(folder) / "masks");
  std::ostringstream yaml;
  yaml.precision(9);
  const Camera& first = d.cameras.front();
  yaml << "# Written by `tactus doctor --fix`.\nunit_m: 1\nup: +y\nimage_size_px: [" << first.width_px << ", "
       << first.height_px << "]\nworkspace_m: {min: [" << workspace_m.min.x << ", " << workspace_m.min.y
       << ", " << workspace_m.min.z << "], max: [" << workspace_m.max.x << ", " << workspace_m.max.y << ", "
       << workspace_m.max.z << "]}\ncameras:\n";
  for (std::size_t c = 0; c < d.cameras.size(); ++c) {
    if (d.masks[c].words.empty()) continue;
    const Camera& camera = d.cameras[c];
    write_calibration((fs::path(folder) / "cameras" / (camera.name + ".yaml")).string(), camera);
    write_mask((fs::path(folder) / "masks" / (camera.name + ".png")).string(), d.masks[c]);
    yaml << "  - name: " << camera.name << "\n    calibration: cameras/" << camera.name
         << ".yaml\n    mask: masks/" << camera.name << ".png\n    image_size_px: [" << camera.width_px
         << ", " << camera.height_px << "]\n";
  }
  SafeFile file((fs::path(folder) / "rig.yaml").string());
  file.write(yaml.str());
  file.commit();
}

void add_evidence(Evidence evidence, bool had_distances, DoctorReport& report) {
  Diagnosis& d = report.diagnosis;
  report.evidence = std::move(evidence.lines);
  if (!evidence.metric && !had_distances && d.verdict != Verdict::faulty)
    report.evidence.emplace_back(
        "not checked: the scale, which silhouettes don't show. Measure a distance between two cameras "
        "(--distance "
        "CAMERA CAMERA METRES), or an object and its hull");
  for (DoctorFinding& f : evidence.findings) {
    d.findings.push_back(f);
    if (d.verdict == Verdict::faulty) continue;
    d.verdict = Verdict::faulty;
    d.why = had_distances && f.fault == "distances between cameras"
                ? "the silhouettes may agree, but the measured distances do not"
                : f.fault;
    d.help.clear();
  }
  // Distances between cameras say nothing of their lenses.
  if (d.verdict == Verdict::unsure && evidence.metric && (evidence.depth || !doubts_focal_lengths(d))) {
    d.verdict = Verdict::well;
    d.why = "the silhouettes agree, and so does the metric evidence";
    d.help.clear();
  }
}

DoctorReport examine(const DoctorOptions& options) {
  const SourceKind kind = kind_of(options);
  DataOptions data;
  data.colors = false;
  if (options.frame) data.first_frame = options.frame;
  const std::unique_ptr<FrameSource> source = open_source(kind, options.rig, data);
  DoctorInput input{source->rig().cameras, {}, source->rig().workspace_m};
  const bool is_rig_file = kind == SourceKind::masks || kind == SourceKind::videos;
  const RigFile file = is_rig_file ? read_rig_file(options.rig) : RigFile{};
  if (is_rig_file) input.R_file_world = file.R_file_world;
  if (!options.corners.empty() && !is_rig_file)
    throw usage_error(std::string("--corners needs a rig file: a folder of '") + word_of(kind) +
                      "' has no lenses");
  FrameSet frame, first;
  RunNotices notices;  // says each line once, not for each tick
  while (input.ticks.size() < kTicks) {
    const NextFrame next = source->next(frame);
    if (next == NextFrame::no_more_data) break;
    if (next != NextFrame::success) continue;
    notices.note(source->status());
    if (input.ticks.empty()) first = frame;
    input.ticks.push_back(frame.silhouettes);
  }
  if (input.ticks.empty()) throw Error("'" + options.rig + "' gave no usable frame: " + source->status());
  DoctorReport report{options.rig, input.cameras,   input.workspace_m, examine_rig(input), {},
                      0,           source->damage()};
  Evidence evidence;
  double mean_recall = 0;
  for (const double r : report.diagnosis.recall_after)
    mean_recall += r / static_cast<double>(report.diagnosis.recall_after.size());
  std::vector<Distance> distances = measured_distances(options, input.cameras);
  for (const Distance& d : board_distances(options, file, evidence.lines)) distances.push_back(d);
  weigh_distances(distances, input.cameras, mean_recall, evidence);
  weigh_depth(*source, first, mean_recall, evidence);
  weigh_times(options, mean_recall, evidence);
  add_evidence(std::move(evidence), !distances.empty(), report);
  report.seen_by_few = seen_by_few(report.diagnosis.cameras, input.workspace_m);
  return report;
}

void doctor(const DoctorOptions& options) {
  for (const std::string& path : {options.json_path, options.html_path}) {
    if (!path.empty()) output_is_writable(path);
  }
  const DoctorReport report = examine(options);
  print_doctor(report);
  note_damage(report.damage);
  if (!options.json_path.empty()) write_json_file(options.json_path, doctor_json(report));
  if (!options.html_path.empty()) write_doctor_html(options.html_path, report);
  if (!options.fix_folder.empty())
    write_fixed(options.fix_folder, report.diagnosis, report.diagnosis.workspace_m);
  const Verdict v = report.diagnosis.verdict;
  if (v != Verdict::well) set_exit_code(v == Verdict::faulty ? kExitFaulty : kExitUnsure);
}

}  // namespace

void add_doctor_command(CLI::App& app) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = app.add_subcommand(
      "doctor",
      "What is wrong with a rig: which camera, what fault, what cures it (exit 0 well, 4 faulty, 5 "
      "is not known)");
  command->add_option("rig", options->rig, "rig file, or folder of a Middlebury data set")->required();
  command->add_option("--source", options->source, "masks, videos or middlebury (default: as the rig says)");
  command->add_option("--frame", options->frame, "the frame to look at (default: the first)");
  command
      ->add_option("--distance", options->distances,
                   "two cameras and the measured metres between them: cam1 cam3 2.83; may be given again")
      ->type_size(3)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_option("--corners", options->corners,
                      "CAMERA=FILE: clicked corners of a board that stands in the world (with --board)");
  command->add_option("--board", options->board, "inner corners and metres of a square: 8x6x0.115");
  command->add_option("--timestamps", options->timestamps,
                      "CSV with sync_index, cam_id, frame_time [s]: are the cameras synchronised?");
  command->add_option("--fix", options->fix_folder, "write a copy of the rig with all cures to this folder");
  add_output(*command, "--json", options->json_path, "write verdict and findings (-: standard output)");
  add_output(*command, "--html", options->html_path,
             "write a page with a picture of the rig (-: standard output)");
  command->footer(
      "Examples:\n  tactus doctor rigs/horseman-masks.yaml --distance cam1 cam3 2.83\n"
      "  tactus doctor $TACTUS_DATA/middlebury_dino --html dino.html\n"
      "  tactus doctor my/rig.yaml --fix cured && tactus reconstruct --source masks cured/rig.yaml");
  command->callback([options] { doctor(*options); });
}

}  // namespace tactus
