#include <opencv2/core/utility.hpp>

#include "tactus/cli/blade_bench.h"
#include "tactus/cli/program.h"
#include "tactus/cli/version.h"
#include "tactus/cli/wire_bench.h"

int main(int argc, char** argv) {
  return tactus::run_program(
      argc, argv, "tactus", "Tactus: real objects, seen by cameras, touch virtual ones.", [](CLI::App& app) {
        app.set_version_flag("--version", [] { return tactus::version_text(); });
        app.footer(
            "Examples:\n  tactus run scenes/demo.yaml\n  tactus reconstruct --source synthetic hand "
            "--resolution 128 --mesh hand.ply\n"
            "  tactus bench hull --devices cpu\n  tactus info\nExit codes: 0 done, 1 failed, 2 wrong usage, "
            "130 interrupted.");
        tactus::add_run_command(app);
        tactus::add_reconstruct_command(app);
        tactus::add_doctor_command(app);
        tactus::add_background_command(app);
        tactus::add_synth_command(app);
        tactus::add_noise_command(app);
        tactus::add_masks_command(app);
        tactus::add_calibrate_command(app);
        tactus::add_calibration_command(app);
        tactus::add_keys_command(app);
        tactus::add_client_command(app);
        tactus::add_serve_command(app);
        tactus::add_rig_command(app);
        tactus::add_blade_benchmark();
        tactus::add_wire_benchmark();
        tactus::add_bench_command(app);
        tactus::add_paper_command(app);
        tactus::add_info_command(app);
        cv::setNumThreads(1);  // one pool of threads for the process: ours
      });
}
