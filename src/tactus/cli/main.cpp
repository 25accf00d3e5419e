#include <opencv2/core/utility.hpp>

#include "tactus/cli/exit_codes.h"
#include "tactus/cli/program.h"
#include "tactus/cli/version.h"

int main(int argc, char** argv) {
  return tactus::run_program(
      argc, argv, "tactus", "Tactus: real objects, seen by cameras, touch virtual ones.", [](CLI::App& app) {
        app.set_version_flag("--version", [] { return tactus::version_text(); });
        app.footer(
            std::string(
                "Examples:\n  tactus run scenes/demo.yaml\n  tactus reconstruct --source synthetic hand "
                "--resolution 128 --mesh hand.ply\n"
                "  tactus help run\n  tactus info\nExit codes:") +
            tactus::exit_codes_text());
        tactus::add_run_command(app);
        tactus::add_view_command(app);
        tactus::add_xr_command(app);
        tactus::add_export_command(app);
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
        tactus::add_bench_command(app);
        tactus::add_paper_command(app);
        tactus::add_info_command(app);
        tactus::add_help_commands(app);
        cv::setNumThreads(1);  // one pool of threads for the process: ours
      });
}
