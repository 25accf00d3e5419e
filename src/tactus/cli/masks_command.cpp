#include <cstdio>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/program.h"
#include "tactus/cli/source_flags.h"
#include "tactus/rig/data_writers.h"
#include "tactus/run/frame_sources.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

struct MasksOptions {
  std::string source = "masks", what, frames, folder;
  ThresholdOptions threshold;
  bool alpha = false;
};

void write_frame(const MasksOptions& options, const Rig& rig, const FrameSet& frame) {
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const BitMask& mask = frame.silhouettes.at(i);
    if (mask.words.empty()) continue;  // the camera missed the tick
    char number[24];
    std::snprintf(number, sizeof number, "_%04lld", static_cast<long long>(frame.tick));
    const std::string name = options.folder + "/" + fs::path(rig.cameras[i].name).stem().string() + number;
    write_mask(name + ".png", mask);
    if (options.alpha) write_alpha(name + "_alpha.png", frame.alphas.at(i));
  }
}

void write_masks(const MasksOptions& options) {
  check_threshold_flags(options.threshold);
  if (options.alpha && options.source != "videos")
    throw usage_error("--alpha: silhouettes of --source '" + options.source +
                      "' are not cut out before an empty room; expected --source videos");
  const auto source =
      open_frame_source(describe_source(options.source, options.what, options.frames),
                        {.alphas = options.alpha, .depth = false, .threshold = options.threshold});
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (!fs::is_directory(options.folder))
    throw Error("--out '" + options.folder + "': can't make this folder");
  FrameSet frame;
  int frames = 0;
  while (!interrupted()) {
    const NextFrame next = source->next(frame);
    if (next == NextFrame::no_more_data) break;
    if (!source->status().empty()) log_warning(source->status());
    if (next != NextFrame::success) continue;
    write_frame(options, source->rig(), frame);
    ++frames;
  }
  if (frames == 0 && !interrupted())
    throw Error("'" + options.what + "' gave no usable frame: " + source->status());
  note_damage(source->damage());
  std::printf("%d frames of %zu cameras in %s\n", frames, source->rig().cameras.size(),
              options.folder.c_str());
}

}  // namespace

void add_masks_command(CLI::App& app) {
  auto options = std::make_shared<MasksOptions>();
  CLI::App* command = app.add_subcommand(
      "masks", "Writes the silhouettes that a source delivers: undistorted, as the hull gets them");
  command->add_option("--source", options->source, source_kind_words())->capture_default_str();
  command->add_option("what", options->what, "rig file, folder or figure")->required();
  command->add_option("--out", options->folder, "folder for CAMERA_0000.png, ...")->required();
  command->add_option("--frames", options->frames, "A-B, A- or A (default: the first; videos: all)");
  command->add_flag("--alpha", options->alpha,
                    "videos: also CAMERA_0000_alpha.png, how much of each pixel the subject covers");
  add_threshold_flags(*command, options->threshold);
  command->footer("Example:\n  tactus masks --source videos rigs/horseman.yaml --frames 0-9 --out masks");
  command->callback([options] { write_masks(*options); });
}

}  // namespace tactus
