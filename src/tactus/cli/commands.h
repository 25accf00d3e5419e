#pragma once
/// The verbs. Each adds its subcommand with flags, help and callback; errors are thrown.
#include <CLI/CLI.hpp>
#include <string>

namespace tactus {
/// An option for a file to write; with "-" it owns standard output, and printed text goes to standard error.
CLI::Option* add_output(CLI::App& command, const std::string& flags, std::string& path,
                        const std::string& help);
/// --devices: where a verb computes. Without the flag, TACTUS_DEVICES of the environment counts, then
/// `devices`.
CLI::Option* add_devices(CLI::App& command, std::string& devices);

void add_run_command(CLI::App& app);
void add_view_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_xr_command(CLI::App& app);
void add_reconstruct_command(CLI::App& app);
void add_background_command(CLI::App& app);
void add_doctor_command(CLI::App& app);
void add_synth_command(CLI::App& app);
void add_noise_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_info_command(CLI::App& app);
/// `help`, `version` and `completion`: of the verbs that are there by then.
void add_help_commands(CLI::App& app);
void add_calibration_command(CLI::App& app);
void add_masks_command(CLI::App& app);
void add_calibrate_command(CLI::App& app);
void add_paper_command(CLI::App& app);
void add_keys_command(CLI::App& app);
void add_client_command(CLI::App& app);
void add_serve_command(CLI::App& app);
void add_rig_command(CLI::App& app);
}  // namespace tactus
