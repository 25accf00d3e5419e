#include <cstdio>

#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
#include "tactus/rig/background/background_film.h"

namespace tactus {
namespace {

struct BackgroundCommandOptions {
  std::string film, out;
  bool median = false;
};

void background(const BackgroundCommandOptions& options) {
  output_is_writable(options.out);
  const LearntRoom room = learn_room(options.film, options.median);
  room.model.write(options.out);
  std::printf("%s: %dx%d pixels, %d frames; noise %.2f, flicker %.2f, sharpness %.1f grey levels\n",
              options.out.c_str(), room.width_px, room.height_px, room.frames, room.model.mean_spread(),
              room.flicker, room.sharpness);
}

}  // namespace

void add_background_command(CLI::App& app) {
  auto options = std::make_shared<BackgroundCommandOptions>();
  CLI::App* command = app.add_subcommand(
      "background", "Learn the empty room of a camera and store it, for `empty_room` of a rig file");
  command->add_option("film", options->film, "film or still picture of the empty room")->required();
  command->add_option("--out", options->out, "picture to write (.png): means above spreads")->required();
  command->add_flag("--median", options->median,
                    "the subject is in the film and moves: each pixel's median is the room");
  command->footer(
      "Examples:\n  tactus background cam1/empty.mp4 --out cam1/room.png\n"
      "  tactus background cam1/film.mp4 --median --out cam1/room.png");
  command->callback([options] { background(*options); });
}

}  // namespace tactus
