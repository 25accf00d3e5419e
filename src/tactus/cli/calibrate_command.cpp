#include <cstdio>
#include <filesystem>
#include <map>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/calibrate_tof.h"
#include "tactus/cli/commands.h"
#include "tactus/rig/calibrate/calibrate_cameras.h"
#include "tactus/rig/calibrate/coverage.h"
#include "tactus/rig/calibration_files/calibration_file.h"

namespace tactus {
namespace {

struct BoardFlags {
  std::string board;
  double square_mm = 0, marker_mm = 0;
  bool inverted = false;
};
struct SolverFlags {
  std::string lens = "brown";
  int coefficients = 5, every = 1;
};
struct CalibrateOptions {
  BoardFlags board;
  SolverFlags solver;
  std::vector<std::string> cameras;
  std::string name = "camera", lenses, out, report;
  double lenses_unit_m = 1;
  bool refine_lenses = false;
  int floor = -1;
};

Board board_of(const BoardFlags& flags) {
  return parse_board(flags.board, 1e-3 * flags.square_mm, 1e-3 * flags.marker_mm, flags.inverted);
}

BundleOptions bundle_options(const SolverFlags& flags) {
  try {
    return lens_options(flags.lens, flags.coefficients);
  } catch (const Error& error) {
    throw usage_error(std::string("--") + error.what());
  }
}

/// Finds the board in all pictures. Prints, per camera, the number of pictures that show it and advice on
/// coverage.
BoardPictures look(const Board& board, const std::vector<std::string>& names,
                   const std::vector<std::string>& pictures, int every) {
  BoardPictureOptions options;
  options.step = every;
  options.progress = [&](Index camera, Index done, Index of) {
    if (done % 25 == 0)
      log_info(names[static_cast<std::size_t>(camera)] + ": " + std::to_string(done) +
               (of > 0 ? " of " + std::to_string(of) : "") + " pictures");
  };
  BoardPictures seen = find_boards(board, pictures, options);
  for (std::size_t c = 0; c < names.size(); ++c) {
    Index views = 0;
    for (const BoardView& v : seen.views) views += static_cast<std::size_t>(v.camera) == c ? 1 : 0;
    std::printf("%-12s board in %d of %d pictures\n", names[c].c_str(), views, seen.picture_count[c]);
    if (const Coverage coverage = coverage_of(seen.views, static_cast<Index>(c), seen.size_px[c]);
        !coverage.advice.empty())
      std::printf("%-12s %s\n", "", coverage.advice.c_str());
  }
  return seen;
}

void print_result(const BundleResult& r) {
  std::printf("%-12s %8s %9s %9s %9s %9s %22s\n", "camera", "RMS px", "fx px", "fy px", "cx px", "cy px",
              "+- fx px, centre mm");
  for (std::size_t c = 0; c < r.cameras.size(); ++c) {
    const Camera& k = r.cameras[c].camera;
    const CameraDeviations& d = r.deviations[c];
    std::printf("%-12s %8.3f %9.2f %9.2f %9.2f %9.2f %13.3f %8.3f\n", k.name.c_str(), r.camera_rms_px[c],
                k.fx_px, k.fy_px, k.cx_px, k.cy_px, d.fx_px, 1e3 * length(d.center_m));
  }
  std::printf("RMS %.3f px of %lld corners\n", r.rms_px, static_cast<long long>(r.corners));
  for (const ViewResidual& v : r.views) {
    if (v.left_out)
      log_warning("camera '" + r.cameras[static_cast<std::size_t>(v.camera)].camera.name + "': picture " +
                  std::to_string(v.instant) + " was left out, its RMS is " + number_text(v.rms_px) + " px");
  }
}

void calibrate_intrinsics(const CalibrateOptions& options) {
  const Board board = board_of(options.board);
  const BundleOptions bundle = bundle_options(options.solver);
  if (!calibration_missing().empty()) throw Error(calibration_missing());
  output_is_writable(options.out);
  // One list of pictures is one camera; several single pictures are numbered here.
  BoardPictures seen;
  const std::vector<std::string> names{options.name};
  if (options.cameras.size() == 1) {
    seen = look(board, names, options.cameras, options.solver.every);
  } else {
    seen = find_boards(board, options.cameras, {});
    for (BoardView& v : seen.views) {
      v.instant = v.camera;
      v.camera = 0;
    }
    for (const Vec2i size : seen.size_px) {
      if (size != seen.size_px[0])
        throw Error("the pictures have different sizes: they are not of one camera");
    }
    seen.picture_count = {static_cast<Index>(options.cameras.size())};
    std::printf("%-12s board in %zu of %zu pictures\n", options.name.c_str(), seen.views.size(),
                options.cameras.size());
    if (const Coverage coverage = coverage_of(seen.views, 0, seen.size_px[0]); !coverage.advice.empty())
      std::printf("%-12s %s\n", "", coverage.advice.c_str());
  }
  const CalibrationReport report =
      calibrate_cameras(board, seen, names, {.bundle = bundle, .lenses = {}, .floor = {}});
  print_result(report.result);
  write_lens_calibration(report, options.out);
  if (!options.report.empty()) write_calibration_page(report, options.report);
  std::printf("written: %s\n", options.out.c_str());
}

/// "name=pictures" of every --camera.
void split_cameras(const std::vector<std::string>& cameras, std::vector<std::string>& names,
                   std::vector<std::string>& pictures) {
  for (const std::string& camera : cameras) {
    const std::size_t at = camera.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == camera.size())
      throw usage_error("--camera '" + camera +
                        "': expected NAME=PICTURES (a film, or a pattern with one %d)");
    names.push_back(camera.substr(0, at));
    pictures.push_back(camera.substr(at + 1));
    for (std::size_t i = 0; i + 1 < names.size(); ++i) {
      if (names[i] == names.back()) throw usage_error("--camera '" + names.back() + "' stands there twice");
    }
  }
  if (names.size() < 2)
    throw usage_error("--camera: expected at least two cameras; for one there is calibrate intrinsics");
}

/// Lenses of a file, or of files given as a folder NAME.yaml. Poses in it don't matter.
std::vector<CalibratedCamera> read_lenses(const CalibrateOptions& options,
                                          const std::vector<std::string>& names,
                                          const std::vector<Vec2i>& size_px) {
  std::vector<CalibratedCamera> cameras;
  for (std::size_t c = 0; c < names.size(); ++c) {
    CalibrationAnswers answers;
    answers.image_size_px = size_px[c];
    answers.unit_m = options.lenses_unit_m;
    const std::string own = options.lenses + "/" + names[c] + ".yaml";
    const std::string path = std::filesystem::is_regular_file(own) ? own : options.lenses;
    CalibrationData data;
    try {
      data = read_calibration_file(path, answers);
    } catch (const Error& e) {
      if (e.kind() != ErrorKind::usage) throw;
      answers.unit_m.reset();  // the file knows its unit
      data = read_calibration_file(path, answers);
    }
    for (FileCamera& camera : data.cameras) camera.has_pose = true;
    cameras.push_back(camera_of(data, names[c], path).calibrated);
    cameras.back().camera.name = names[c];
    cameras.back().camera.T_cam_world = {};
  }
  return cameras;
}

void calibrate_rig(const CalibrateOptions& options) {
  const Board board = board_of(options.board);
  const BundleOptions bundle = bundle_options(options.solver);
  if (!calibration_missing().empty()) throw Error(calibration_missing());
  std::vector<std::string> names, pictures;
  split_cameras(options.cameras, names, pictures);
  const BoardPictures seen = look(board, names, pictures, options.solver.every);
  CalibrateCamerasOptions how{
      .bundle = bundle, .lenses = {}, .refine_lenses = options.refine_lenses, .floor = {}};
  if (options.lenses.empty())
    log_info("lenses from the same pictures (better: --lenses, from pictures close to the board)");
  else
    how.lenses = read_lenses(options, names, seen.size_px);
  if (options.floor >= 0)
    how.floor = options.floor;
  else
    log_warning("the world is that of camera '" + names[0] +
                "', taken as level; with --floor N it is the board as it lies in picture N");
  const CalibrationReport report = calibrate_cameras(board, seen, names, how);
  print_result(report.result);
  write_rig_calibration(report, options.out,
                        options.report.empty() ? options.out + "/report.html" : options.report);
  std::printf("written: %s/rig.yaml, cameras.json, report.html\n", options.out.c_str());
}

void add_board_flags(CLI::App& command, BoardFlags& flags) {
  command
      .add_option("--board", flags.board,
                  "chessboard:9x6 (inner corners) or charuco:4x5:4X4_50 (squares, dictionary)")
      ->required();
  command.add_option("--square-mm", flags.square_mm, "side of a square [mm]")->required();
  command.add_option("--marker-mm", flags.marker_mm, "charuco: side of a marker [mm]");
  command.add_flag("--inverted", flags.inverted, "the board is printed white on black");
}

void add_solver_flags(CLI::App& command, SolverFlags& flags) {
  command.add_option("--lens", flags.lens, "brown or fisheye")->capture_default_str();
  command.add_option("--coefficients", flags.coefficients, "of a brown lens: 2, 4, 5 or 8")
      ->capture_default_str();
  command.add_option("--every", flags.every, "look at every so many frames of films")
      ->check(CLI::Range(1, 10000));
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("calibrate", "Cameras from pictures of a board: lenses, whole rigs, depth");
  command->require_subcommand(1);
  auto lens = std::make_shared<CalibrateOptions>();
  CLI::App* intrinsics = command->add_subcommand("intrinsics", "Lens of one camera");
  intrinsics->add_option("pictures", lens->cameras, "a film, a pattern with one %d, or several pictures")
      ->required();
  add_board_flags(*intrinsics, lens->board);
  add_solver_flags(*intrinsics, lens->solver);
  intrinsics->add_option("--name", lens->name, "of the camera")->capture_default_str();
  intrinsics->add_option("--out", lens->out, "OpenCV YAML that is written")->required();
  intrinsics->add_option("--report", lens->report, "HTML with coverage, residuals and standard deviations");
  intrinsics->footer(
      "Example:\n  tactus calibrate intrinsics --board chessboard:9x6 --square-mm 25 left*.jpg --out "
      "left.yaml");
  intrinsics->callback([lens] { calibrate_intrinsics(*lens); });
  auto rig = std::make_shared<CalibrateOptions>();
  CLI::App* whole =
      command->add_subcommand("rig", "Poses of all cameras from pictures taken at the same instants");
  whole
      ->add_option("--camera", rig->cameras,
                   "NAME=PICTURES: a film, or a pattern with one %d; once per camera")
      ->required();
  add_board_flags(*whole, rig->board);
  add_solver_flags(*whole, rig->solver);
  whole->add_option("--lenses", rig->lenses,
                    "calibration with the cameras' lenses, or a folder with NAME.yaml");
  whole->add_flag("--refine-lenses", rig->refine_lenses, "improve these lenses, too");
  whole->add_option("--floor", rig->floor,
                    "picture in which the board lies on the floor: origin and +Y up of the world");
  whole->add_option("--out", rig->out, "folder for rig.yaml, cameras.json, report.html")->required();
  whole->add_option("--report", rig->report, "another place for the HTML");
  whole->footer(
      "Example:\n  tactus calibrate rig --board charuco:4x5:4X4_50 --square-mm 54 --marker-mm 40.5 \\\n"
      "    --camera a=a.mp4 --camera b=b.mp4 --lenses lenses --floor 12 --out rig");
  whole->callback([rig] { calibrate_rig(*rig); });
  add_calibrate_tof(*command);
}

}  // namespace tactus
