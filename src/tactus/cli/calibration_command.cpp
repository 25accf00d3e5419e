#include <algorithm>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/commands.h"
#include "tactus/rig/calibration_files/calibration_file.h"

namespace tactus {
namespace {

struct CalibrationOptions {
  std::vector<std::string> files;  ///< the last is the output
  std::string to, lens, format;
  double unit_m = 0;
  std::vector<int> size_px;
};

CalibrationAnswers answers_of(const CalibrationOptions& options) {
  CalibrationAnswers answers;
  answers.format = options.format;
  if (options.unit_m != 0) {
    if (!(options.unit_m >= 1e-9 && options.unit_m <= 1e9))
      throw usage_error("--unit-m " + number_text(options.unit_m) + ": expected metres, 1e-9 to 1e9");
    answers.unit_m = options.unit_m;
  }
  if (!options.size_px.empty()) {
    if (options.size_px.size() != 2) throw usage_error("--image-size takes two numbers (W,H)");
    answers.image_size_px = Vec2i{options.size_px[0], options.size_px[1]};
  }
  if (options.lens.empty()) return answers;
  if (options.lens != "brown" && options.lens != "fisheye" && options.lens != "none")
    throw usage_error("--lens '" + options.lens + "': expected brown, fisheye or none");
  answers.lens = options.lens == "brown"  ? LensModel::brown
                 : options.lens == "none" ? LensModel::none
                                          : LensModel::fisheye;
  return answers;
}

void print_cameras(const std::vector<FileCamera>& cameras) {
  std::printf("%-16s %11s %9s %9s %9s %9s  %-8s %s\n", "camera", "image px", "fx px", "fy px", "cx px",
              "cy px", "lens", "centre m");
  for (const FileCamera& file : cameras) {
    const Camera& c = file.calibrated.camera;
    const std::string size = std::to_string(c.width_px) + "x" + std::to_string(c.height_px);
    const Vec3d at = c.center_world();
    std::printf("%-16s %11s %9.2f %9.2f %9.2f %9.2f  %-8s ", c.name.c_str(), size.c_str(), c.fx_px, c.fy_px,
                c.cx_px, c.cy_px, lens_name(file.calibrated.lens.model).c_str());
    if (file.has_pose) {
      std::printf("%.4f %.4f %.4f\n", at.x, at.y, at.z);
    } else {
      std::printf("none: a lens alone\n");
    }
  }
}

/// Cameras of all files, one after the other.
std::vector<FileCamera> read_all(std::span<const std::string> files, const CalibrationAnswers& answers) {
  std::vector<FileCamera> cameras;
  std::string reported;
  for (const std::string& file : files) {
    const CalibrationData data = read_calibration_file(file, answers);
    reported += file + ": " + data.format + ", " + std::to_string(data.cameras.size()) + " cameras\n";
    for (const FileCamera& camera : data.cameras) {
      for (const FileCamera& other : cameras) {
        if (other.calibrated.camera.name == camera.calibrated.camera.name)
          throw Error(file + ": camera '" + camera.calibrated.camera.name +
                      "' came with another file already");
      }
      cameras.push_back(camera);
    }
  }
  std::printf("%s", reported.c_str());
  return cameras;
}

/// Lenses of cameras that were not placed, beside cameras that were.
void leave_out_lenses(std::vector<FileCamera>& cameras) {
  if (std::ranges::none_of(cameras, &FileCamera::has_pose)) return;
  std::erase_if(cameras, [](const FileCamera& c) {
    if (!c.has_pose)
      log_warning("camera '" + c.calibrated.camera.name +
                  "' is a lens without a pose and left out; opencv files hold it");
    return !c.has_pose;
  });
}

void convert(const CalibrationOptions& options) {
  if (options.files.size() < 2)
    throw usage_error("convert: expected IN OUT, the files to read and the one to write");
  check_written_format(options.to);
  std::vector<FileCamera> cameras =
      read_all(std::span(options.files).first(options.files.size() - 1), answers_of(options));
  if (options.to != "opencv") leave_out_lenses(cameras);
  write_calibration_file(options.files.back(), options.to, cameras);
  print_cameras(cameras);
  std::printf("written: %s (%s, metres)\n", options.files.back().c_str(), options.to.c_str());
}

void add_question_flags(CLI::App& command, CalibrationOptions& options) {
  command.add_option("--unit-m", options.unit_m, "metres per unit of the files, where they don't say it");
  command.add_option("--image-size", options.size_px, "W,H [px], where they don't say it")->delimiter(',');
  command.add_option("--lens", options.lens,
                     "brown, fisheye or none: what coefficients mean, where they don't say it");
  command.add_option("--format", options.format, "format of the files, where content doesn't decide");
}

std::string format_list() {
  std::string text = "Formats:\n";
  for (const CalibrationFormatInfo& f : calibration_formats()) {
    text += "  " + f.name + std::string(15 - std::min<std::size_t>(f.name.size(), 14), ' ') + f.of +
            (f.written ? " [written too]" : "") + (f.asks.empty() ? "" : "; asks for " + f.asks) + "\n";
  }
  return text;
}

}  // namespace

void add_calibration_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("calibration", "Calibrations of other tools: convert, show");
  command->require_subcommand(1);
  auto options = std::make_shared<CalibrationOptions>();
  CLI::App* to =
      command->add_subcommand("convert", "Writes cameras of one or more files in another format, in metres");
  to->add_option("files", options->files, "IN [IN ...] OUT: files or folders of any format below")
      ->required();
  to->add_option("--to", options->to,
                 "opencv (a folder for several cameras), kalibr, multical, colmap, pose2sim")
      ->required();
  add_question_flags(*to, *options);
  to->footer(format_list() + "Example:\n  tactus calibration convert camchain.yaml rig.toml --to pose2sim");
  to->callback([options] { convert(*options); });
  auto shown = std::make_shared<CalibrationOptions>();
  CLI::App* show = command->add_subcommand("show", "Lists the cameras of files");
  show->add_option("files", shown->files, "files or folders of any format")->required();
  add_question_flags(*show, *shown);
  show->footer(format_list());
  show->callback([shown] { print_cameras(read_all(shown->files, answers_of(*shown))); });
}

}  // namespace tactus
