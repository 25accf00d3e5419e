#pragma once
/// The sinks of `tactus run`, and its results.
#include <optional>

#include "tactus/cli/run_flags.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/sinks/explain_sink.h"
#include "tactus/run/sinks/mesh_sink.h"
#include "tactus/run/sinks/picture_sink.h"
#include "tactus/run/sinks/progress_sink.h"
#include "tactus/run/sinks/report_sink.h"
#include "tactus/run/sinks/usd_sink.h"

namespace tactus {

/// The sinks that the flags and the scene ask for.
struct RunSinks {
  std::optional<ReportSink> report;
  std::optional<ExplainSink> explain;
  CrushSink crush;
  std::optional<VtkSink> vtk;
  std::optional<UsdSink> usd;
  std::optional<MeshSink> meshes;
  std::optional<PictureSink> pictures;
  std::optional<BudgetSink> budget;
  std::optional<ProgressSink> progress;

  void add_to(FrameLoop& loop) {
    if (report) loop.add(*report);
    if (explain) loop.add(*explain);
    loop.add(crush);
    if (vtk) loop.add(*vtk);
    if (usd) loop.add(*usd);
    if (meshes) loop.add(*meshes);
    if (pictures) loop.add(*pictures);
    if (budget) loop.add(*budget);
    if (progress) loop.add(*progress);
  }
};

/// Writes the results after the last frame: files, a table, warnings. @throws Error when no frame came, or
/// the real surface was open.
void finish_run(const RunOptions& options, const Scene& scene, const FrameSource& source, World& world,
                const FrameLoop& loop, RunSinks& sinks, const std::string& stem, const std::string& devices);

}  // namespace tactus
