// A loop of your own: a scene, filmed live or as it says, with a recording, a budget and a checkpoint.
//   hello_loop SCENE.yaml [RIG.yaml]      the second: cameras that send live, as docs/live.md says
#include <cstdio>
#include <filesystem>

#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/run/sinks.h"

using namespace tactus;

// Sees each frame after it was simulated. Files, pictures and networks are such sinks, too.
struct PrintForce : FrameSink {
  void frame(RunFrame& frame) override {
    for (const BodyContact& c : frame.report.contacts)
      std::printf("frame %d: %s and %s touch with %.3f N\n", frame.number, c.body.c_str(),
                  c.component.c_str(), static_cast<double>(length(c.reaction.force_N)));
  }
};

int main(int argc, char** argv) try {
  if (argc < 2) return std::fprintf(stderr, "usage: hello_loop SCENE.yaml [RIG.yaml]\n"), 2;
  Scene scene = read_scene(argv[1]);
  if (argc > 2) {
    scene.source = {};
    scene.source.kind = SourceKind::live;
    scene.source.path = argv[2];
  }
  DeviceSet devices("auto");
  std::unique_ptr<FrameSource> source = open_scene_source(scene, argv[1]);
  const BodyAssets assets = load_body_assets(scene);
  constexpr bool kCanReduce = true;  // for the budget
  const auto perception = make_perception(devices, scene, source->rig(), assets, kCanReduce);
  World world(devices, scene, assets, perception.get());

  std::filesystem::remove("hello_loop.rec");  // a recording is never overwritten
  RecordingFilter recorded(std::move(source), "hello_loop.rec");
  PrintForce print;
  const std::unique_ptr<FrameSink> budget = make_budget_sink(0.033, world);
  FrameLoop loop(recorded, world, {.most_frames = 30, .should_stop = {}});
  loop.add(print);
  loop.add(*budget);
  loop.run();
  recorded.finish();
  write_checkpoint("hello_loop.checkpoint", argv[1], loop.progress(), world);
  std::printf("%d frames; hello_loop.rec and hello_loop.checkpoint are written\n", loop.frames());
  return loop.frames() > 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
