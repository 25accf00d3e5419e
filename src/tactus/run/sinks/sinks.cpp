#include "tactus/run/sinks.h"

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/io/json_file.h"
#include "tactus/run/sinks/budget_sink.h"
#include "tactus/run/sinks/explain_sink.h"
#include "tactus/run/sinks/mesh_sink.h"
#include "tactus/run/sinks/picture_sink.h"
#include "tactus/run/sinks/progress_sink.h"
#include "tactus/run/sinks/report_sink.h"
#include "tactus/run/sinks/usd_sink.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// Pictures whose files are closed when the loop ends.
class ClosedPictures final : public FrameSink {
 public:
  ClosedPictures(const Scene& scene, const Rig& rig, const BodyAssets& assets, World& world,
                 const std::string& stem, double frames_per_s)
      : pictures_(scene, rig, assets, world, stem, frames_per_s) {}
  void frame(RunFrame& frame) override { pictures_.frame(frame); }
  void end(RunNotices& /*notices*/) override { pictures_.finish(); }

 private:
  PictureSink pictures_;
};

/// A report that is written when the loop ends.
class JsonSink final : public FrameSink {
 public:
  JsonSink(const Scene& scene, const FrameLoop& loop, World& world, const std::string& path)
      : report_(scene), loop_(loop), world_(world), path_(path) {}
  void frame(RunFrame& frame) override { report_.frame(frame); }
  void end(RunNotices& /*notices*/) override {
    nlohmann::json json = report_.to_json(loop_, world_, world_.impl().devices().name());
    json["state_hash"] = state_hash(world_);
    write_json_file(path_, json);
  }

 private:
  ReportSink report_;
  const FrameLoop& loop_;
  World& world_;
  std::string path_;
};

/// @returns `value`. @throws Error (usage) unless it is above 0 and finite.
double positive(double value, const char* name) {
  if (!(value > 0 && std::isfinite(value)))
    throw usage_error(std::string(name) + " is " + number_text(value) + ", expected > 0");
  return value;
}

}  // namespace

std::unique_ptr<FrameSink> make_picture_sink(const Scene& scene, const Rig& rig, const BodyAssets& assets,
                                             World& world, const std::string& stem, double frames_per_s) {
  return std::make_unique<ClosedPictures>(scene, rig, assets, world, stem,
                                          positive(frames_per_s, "frames_per_s of a film"));
}

std::unique_ptr<FrameSink> make_mesh_sink(const Scene& scene, const std::string& stem) {
  return std::make_unique<MeshSink>(scene, stem);
}

std::unique_ptr<FrameSink> make_vtk_sink(int every, const std::string& stem) {
  positive(every, "every, the frames from one VTK file to the next,");
  return std::make_unique<VtkSink>(every, stem);
}

std::unique_ptr<FrameSink> make_usd_sink(const Scene& scene, const BodyAssets& assets,
                                         const std::string& stem, double frames_per_s) {
  return std::make_unique<UsdSink>(scene, assets, stem, positive(frames_per_s, "frames_per_s of a USD file"));
}

std::unique_ptr<FrameSink> make_json_sink(const Scene& scene, const FrameLoop& loop, World& world,
                                          const std::string& path) {
  return std::make_unique<JsonSink>(scene, loop, world, path);
}

std::unique_ptr<FrameSink> make_budget_sink(double budget_s, World& world) {
  return std::make_unique<BudgetSink>(positive(budget_s, "budget_s of a frame"), world, false);
}

std::unique_ptr<FrameSink> make_progress_sink() { return std::make_unique<ProgressSink>(true); }

std::unique_ptr<FrameSink> make_explain_sink(const Scene& scene) {
  return std::make_unique<ExplainSink>(scene);
}

}  // namespace tactus
