// Runs the built program as a script would: exit codes, messages, JSON.
#include <csignal>
#include <cstring>
#include <fstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

class Cli : public ProgramTest {
 protected:
  /// A rig of cameras at (0, 0, -4 m) that look along +z at a 1 m cube, each with a mask of one grey.
  std::string write_mask_rig(const std::vector<int>& greys) const {
    std::ofstream(path("camera.yaml"))
        << "%YAML:1.0\n---\n" +
               opencv_matrix("CameraMatrix", 3, 3, "60., 0., 31.5, 0., 60., 31.5, 0., 0., 1.") +
               opencv_matrix("DistortionCoeffs", 5, 1, "0., 0., 0., 0., 0.") +
               opencv_matrix("RotationValues", 3, 1, "0., 0., 0.") +
               opencv_matrix("TranslationValues", 3, 1, "0., 0., 4.");
    std::string rig =
        "unit_m: 1\nimage_size_px: [64, 64]\n"
        "workspace_m: {min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5]}\ncameras:\n";
    for (std::size_t i = 0; i < greys.size(); ++i) {
      const std::string name(1, static_cast<char>('a' + i));
      std::ofstream(path(name + ".pgm"), std::ios::binary)
          << "P5\n64 64\n255\n"
          << std::string(64 * 64, static_cast<char>(greys[i]));
      rig += "  - {name: " + name + ", calibration: camera.yaml, mask: " + name + ".pgm}\n";
    }
    return write("rig.yaml", rig);
  }

 private:
  static std::string opencv_matrix(const std::string& name, int rows, int columns, const std::string& data) {
    return name + ": !!opencv-matrix\n  rows: " + std::to_string(rows) +
           "\n  cols: " + std::to_string(columns) + "\n  dt: d\n  data: [" + data + "]\n";
  }
};

TEST_F(Cli, HelpAndVersion) {
  const Outcome help = run_tactus("--help");
  EXPECT_EQ(help.code, 0);
  for (const char* verb : {"run", "reconstruct", "bench", "info", "Examples:"})
    EXPECT_NE(help.text.find(verb), std::string::npos);
  const Outcome version = run_tactus("--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.text.rfind("tactus 0.", 0), 0U) << version.text;
  for (const char* verb : {"run", "reconstruct", "synth", "bench", "paper", "info"}) {
    const Outcome verb_help = run_tactus(std::string(verb) + " --help");
    EXPECT_EQ(verb_help.code, 0);
    EXPECT_NE(verb_help.text.find("Example"), std::string::npos) << verb;
  }
}

struct Wrong {
  const char* arguments;
  int code;
  const char* message;
};

TEST_F(Cli, WrongUseIsNamed) {
  const std::string deep = path("no/such/folder/x.ply");
  const Wrong wrongs[] = {
      {"reconstrct hand", 2, "did you mean 'reconstruct'?"},
      {"", 2, "lacks a command; known: run"},
      {"reconstruct --source synthetic hnad", 2, "did you mean 'hand'?"},
      {"reconstruct --source synthetic hand --smooth -1", 2, "--smooth -1: expected 0"},
      {"paper fig41 --out x.png", 2, "did you mean 'fig14'?"},
      {"reconstruct --source synthetc hand", 2, "did you mean 'synthetic'?"},
      {"reconstruct hand --devices cudaa", 2, "did you mean 'cuda'?"},
      {"reconstruct hand --devices cpu:0", 2, "between 1 and 64"},
      {"reconstruct hand --devices cpu --resolution 0", 2, "resolution 0"},
      {"reconstruct hand --devices cpu --resolution -1", 2, "resolution -1"},
      {"reconstruct hand --devices cpu --resolution 1000000", 1, "would need"},
      {"reconstruct hand --devices cpu --resolution many", 2, "--resolution"},
      {"reconstruct hand --devices cpu --frames 9-3", 2, "--frames '9-3'"},
      {"reconstruct hand --devices cpu --workspace 1,2", 2, "six numbers"},
      {"reconstruct hand --devices cpu --wrong", 2, "--wrong"},
      {"reconstruct --source middlebury /no/such/place", 1, "/no/such/place"},
      {"reconstruct --source masks /no/such/rig.yaml", 1, "/no/such/rig.yaml"},
      {"run /no/such/scene.yaml", 1, "/no/such/scene.yaml"},
      {"run /no/such/scene.yaml --frames 0-3", 2, "--frames: '0-3', expected a whole number of frames"},
      {"run /no/such/scene.yaml --frames 0", 2, "1 to 999999999"},
      {"bench hul", 2, "did you mean 'hull'?"},
  };
  for (const Wrong& w : wrongs) {
    const Outcome o = run_tactus(w.arguments);
    EXPECT_EQ(o.code, w.code) << w.arguments << "\n" << o.text;
    EXPECT_EQ(o.text.substr(0, 7), "error: ") << o.text;
    EXPECT_NE(o.text.find(w.message), std::string::npos) << w.arguments << "\n" << o.text;
  }
  for (const char* flag : {"--json ", "--mesh "}) {
    const Outcome o = run_tactus(std::string("reconstruct sphere --devices cpu ") + flag + deep);
    EXPECT_EQ(o.code, 1) << o.text;
    EXPECT_NE(o.text.find("no/such/folder"), std::string::npos) << o.text;
  }
}

TEST_F(Cli, MeshOfAnUnknownKindIsRefusedBeforeTheWork) {
  const Outcome o =
      run_tactus("reconstruct sphere --devices cpu --mesh " + path("s.stp") + " --json " + path("s.json"));
  EXPECT_EQ(o.code, 2) << o.text;
  EXPECT_NE(o.text.find("ends in .ply, .obj, .glb or .gltf"), std::string::npos) << o.text;
  EXPECT_FALSE(fs::exists(path("s.json")));
}

TEST_F(Cli, DepthIsUsedUnlessToldOtherwise) {
  const auto frame_of = [&](const std::string& more) {
    const Outcome o =
        run_tactus("reconstruct bowl --devices cpu --resolution 48 --json " + path("b.json") + " " + more);
    EXPECT_EQ(o.code, 0) << o.text;
    EXPECT_EQ(read_json("b.json")["depth"], more.empty());
    return read_json("b.json")["frames"].at(0);
  };
  const nlohmann::json deep = frame_of(""), plain = frame_of("--no-depth");
  EXPECT_GT(plain["volume_m3"], 1.2 * deep["volume_m3"].get<double>());
  // With depth the mesh follows the figure but for its back; without, the cavity (0.27 m deep) is closed.
  EXPECT_LT(deep["surface_rms_m"], 0.01);
  EXPECT_GT(plain["surface_rms_m"], 0.02);
  EXPECT_EQ(deep["boundary_edges"], 0);
}

TEST_F(Cli, FramesThatAStillPictureDoesNotHaveAreRefused) {
  const std::string rig = write_mask_rig({255, 255});
  const Outcome o = run_tactus("reconstruct --source masks " + rig + " --frames 5-9 --devices cpu --json " +
                               path("n.json"));
  EXPECT_EQ(o.code, 2) << o.text;
  EXPECT_NE(o.text.find("holds one frame"), std::string::npos) << o.text;
  EXPECT_FALSE(fs::exists(path("n.json")));
}

TEST_F(Cli, BlackMasksAndWhiteOnesAreRefused) {
  const auto run = [&](std::vector<int> grey) {
    return run_tactus("reconstruct --source masks " + write_mask_rig(grey) +
                      " --resolution 16 --devices cpu --mesh " + path("m.ply") + " --json " + path("m.json"));
  };
  for (const auto& [grey, status] : {std::pair{std::vector{0, 0}, "all black"},
                                     std::pair{std::vector{255, 0}, "'b': the mask is all black"}}) {
    const Outcome o = run(grey);
    EXPECT_EQ(o.code, 1) << o.text;
    EXPECT_NE(o.text.find("nothing is left of what the masks show"), std::string::npos) << o.text;
    EXPECT_NE(o.text.find(status), std::string::npos) << o.text;
    EXPECT_FALSE(fs::exists(path("m.ply")) || fs::exists(path("m.json")));
  }
  // The hull would be the workspace: nothing can be right.
  const Outcome white = run({255, 255});
  EXPECT_EQ(white.code, 1) << white.text;
  for (const char* part :
       {"all white", "100 % of the surface are faces of the workspace", "`tactus doctor RIG`"})
    EXPECT_NE(white.text.find(part), std::string::npos) << white.text;
}

TEST_F(Cli, CudaOnAMachineWithoutAGpuIsRefused) {
  if (run_tactus("info").text.find("cuda:0") != std::string::npos) GTEST_SKIP() << "there is a GPU here";
  const Outcome o = run_tactus("reconstruct sphere --devices cuda:0");
  EXPECT_EQ(o.code, 2);
  EXPECT_NE(o.text.find("here are: cpu"), std::string::npos) << o.text;
}

TEST_F(Cli, ReconstructsASphereAndMeasuresIt) {
  const Outcome o = run_tactus("reconstruct --source synthetic sphere --resolution 64 --devices cpu --json " +
                               path("s.json") + " --mesh " + path("s.ply"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json json = read_json("s.json");
  EXPECT_EQ(json["devices"], "cpu");
  ASSERT_EQ(json["frames"].size(), 1U);
  const nlohmann::json& f = json["frames"][0];
  EXPECT_EQ(f["boundary_edges"], 0);
  EXPECT_EQ(f["nonmanifold_edges"], 0);
  EXPECT_EQ(f["euler"], 2);
  // The hull of 8 cones is a little larger than the sphere, chords a little smaller than arcs (0.1 % at 64).
  EXPECT_NEAR(f["volume_m3"].get<double>() / f["truth_volume_m3"].get<double>(), 1.03, 0.07);
  EXPECT_GT(f["iou_min"].get<double>(), 0.97);
  EXPECT_GT(f["recall"].get<double>(), 0.98);
  for (const char* stage : {"upload", "hull", "mesh", "total"}) EXPECT_GT(f["ms"][stage].get<double>(), 0);
  EXPECT_GT(fs::file_size(path("s.ply")), 100'000U);
}

TEST_F(Cli, ReconstructWritesTexturedGltf) {
  ASSERT_EQ(run_tactus("synth hand --out " + path("data") + " --cameras 6").code, 0);
  const std::string base =
      "reconstruct --source masks " + path("data/rig.yaml") + " --resolution 64 --devices cpu ";
  const Outcome plain = run_tactus(base + "--json " + path("plain.json"));
  const Outcome o =
      run_tactus(base + "--smooth 2 --texture 2 --mesh " + path("t.glb") + " --json " + path("t.json"));
  ASSERT_EQ(plain.code, 0) << plain.text;
  ASSERT_EQ(o.code, 0) << o.text;
  // The same surface to the smoothing's 1e-4 of its volume; it comes back from the file as it was.
  const nlohmann::json before = read_json("plain.json")["frames"][0],
                       after = read_json("t.json")["frames"][0];
  const double volume = before["volume_m3"].get<double>();
  EXPECT_NEAR(after["volume_m3"].get<double>(), volume, 1e-4 * volume);
  EXPECT_EQ(after["triangles"], before["triangles"]);
  EXPECT_GT(after["ms"]["smooth"].get<double>(), 0);
  std::ifstream file(path("t.glb"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  std::uint32_t json_bytes = 0;
  std::memcpy(&json_bytes, bytes.data() + 12, 4);
  const nlohmann::json gltf = nlohmann::json::parse(bytes.substr(20, json_bytes));
  const nlohmann::json& primitive = gltf["meshes"][0]["primitives"][0];
  EXPECT_EQ(gltf["accessors"][primitive["indices"].get<std::size_t>()]["count"].get<std::int64_t>(),
            3 * after["triangles"].get<std::int64_t>());
  EXPECT_TRUE(primitive["attributes"].contains("TEXCOORD_0"));
  EXPECT_EQ(gltf["images"][0]["mimeType"], "image/png");
  const Outcome again = run_tactus("synth " + path("t.glb") + " --out " + path("again"));
  EXPECT_EQ(again.code, 0) << again.text;
}

TEST_F(Cli, SynthWritesWhatReconstructReads) {
  const Outcome made =
      run_tactus("synth rabbit --moving --frames 3 --fps 10 --out " + path("data") + " --cameras 6");
  ASSERT_EQ(made.code, 0) << made.text;
  const nlohmann::json truth = read_json("data/truth/truth.json");
  ASSERT_EQ(truth["frames"].size(), 3U);
  const Outcome o = run_tactus("reconstruct --source masks " + path("data/rig.yaml") +
                               " --frames 0- --resolution 64 --devices cpu --texture 2 --mesh " +
                               path("t.ply") + " --json " + path("t.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json frames = read_json("t.json")["frames"];
  ASSERT_EQ(frames.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    // The hull of 6 cones around a rounded body: at least the body, at most a fifth more.
    const double ratio = frames[i]["volume_m3"].get<double>() / truth["frames"][i]["volume_m3"].get<double>();
    EXPECT_GT(ratio, 0.99);
    EXPECT_LT(ratio, 1.2);
    EXPECT_GT(frames[i]["iou_min"].get<double>(), 0.97);
    EXPECT_EQ(frames[i]["view_scores"].size(), 6U);
    EXPECT_GE(frames[i]["motions"].size(), 1U);
    EXPECT_EQ(frames[i]["status"], "");
  }
  for (const char* file :
       {"data/truth/surface_0002.ply", "data/depth/tof_0001.png", "data/truth/cameras/cam5.yaml"})
    EXPECT_GT(fs::file_size(path(file)), 100U) << file;
  std::ifstream ply(path("t-00001.ply"));
  std::string header(400, ' ');
  ply.read(header.data(), 400);
  EXPECT_NE(header.find("property uchar red"), std::string::npos);
  EXPECT_NE(header.find("property float nx"), std::string::npos);

  const Outcome again = run_tactus("synth rabbit --out " + path("data"));
  EXPECT_EQ(again.code, 2);
  EXPECT_NE(again.text.find("not an empty folder"), std::string::npos) << again.text;
}

TEST_F(Cli, SynthOfAMeshWithNoiseIsMeasurablyWorse) {
  // The truth of one data set is the mesh that the next is made of.
  ASSERT_EQ(run_tactus("synth hand --no-colors --out " + path("hand")).code, 0);
  const auto worst_iou = [&](const std::string& name, const std::string& noise) {
    const Outcome made = run_tactus("synth " + path("hand/truth/surface_0000.ply") +
                                    " --no-colors --turns 1 " + noise + " --out " + path(name));
    EXPECT_EQ(made.code, 0) << made.text;
    const Outcome o = run_tactus("reconstruct --source masks " + path(name + "/rig.yaml") +
                                 " --resolution 100 --devices cpu --json " + path("n.json"));
    EXPECT_EQ(o.code, 0) << o.text;
    return read_json("n.json")["frames"][0]["iou_min"].get<double>();
  };
  const double exact = worst_iou("exact", "");
  EXPECT_GT(exact, 0.96);
  EXPECT_LT(worst_iou("noisy", "--noise-calibration 3 --noise-segmentation 2"), exact - 0.01);
}

TEST_F(Cli, TextureNeedsPhotosAndEnoughCameras) {
  const Wrong wrongs[] = {
      {"reconstruct hand --devices cpu --texture 9", 2, "k = 9"},
      {"reconstruct hand --devices cpu --texture 0", 2, "expected 1 to 8"},
      {"reconstruct hand --devices cpu --texture 2 --mesh x.obj", 2, "OBJ holds no colours"},
      {"reconstruct hand --devices cpu --texture-views x.png", 2, "needs --texture"},
      {"synth hnad --out nowhere", 2, "did you mean 'hand'?"},
      {"synth hand --out nowhere --noise-sync -1", 2, "sync [ms] is -1"},
      {"synth hand --out nowhere --frames 0", 2, "--frames 0"},
  };
  for (const Wrong& w : wrongs) {
    const Outcome o = run_tactus(w.arguments);
    EXPECT_EQ(o.code, w.code) << w.arguments << "\n" << o.text;
    EXPECT_EQ(o.text.substr(0, 7), "error: ") << o.text;
    EXPECT_NE(o.text.find(w.message), std::string::npos) << w.arguments << "\n" << o.text;
  }
  const Outcome o =
      run_tactus("reconstruct --source masks " + write_mask_rig({0, 0}) + " --devices cpu --texture 1");
  EXPECT_EQ(o.code, 1);
  EXPECT_NE(o.text.find("no photos"), std::string::npos) << o.text;
}

TEST_F(Cli, MovingFiguresHaveAMeasuredVelocity) {
  const Outcome o = run_tactus(
      "reconstruct rabbit --moving --frames 0-6 --resolution 64 --devices cpu --json " + path("v.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json frames = read_json("v.json")["frames"];
  EXPECT_FALSE(frames[0].contains("velocity_rms"));
  // The rabbit swings by 0.8 rad in 4 s: up to 1.3 rad/s, some 2.4 degrees a frame; registration should leave
  // a quarter of the speed at most at this low speed (1 mm of 8 a frame).
  EXPECT_LT(frames[6]["velocity_rms"].get<double>(), 0.25 * frames[6]["speed_rms"].get<double>());
}

TEST_F(Cli, RunsAScene) {
  const std::string scene =
      write("tiny.yaml",
            "source: {kind: synthetic, figure: hand, scale: 0.8, moving: true}\n"
            "reconstruction: {resolution: 32}\n"
            "bodies:\n  - {name: block, shape: {kind: box, size_m: [0.3, 0.2, 0.3]}, spacing_m: 0.05}\n"
            "probes: [{name: top, body: block, position_m: [0, 0.1, 0]}]\n");
  const Outcome o = run_tactus("run " + scene + " --devices cpu --frames 4 --view none --out " + path("out") +
                               " --json " + path("r.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json json = read_json("r.json");
  EXPECT_EQ(json["frames"], 4);
  EXPECT_EQ(json["probes"]["top"].size(), 4U);
  EXPECT_LT(json["probes"]["top"][3][1].get<double>(),
            json["probes"]["top"][0][1].get<double>());  // nothing holds it: it falls
  for (const char* stage : {"hull", "mesh", "surface", "bodies", "embed", "frame"})
    EXPECT_GT(json["ms"][stage]["p99"].get<double>(), 0) << stage;
}

TEST_F(Cli, AFigureThatNothingEndsEndsAfterTheDocumentedFrames) {
  const Outcome from_5 =
      run_tactus("reconstruct sphere --frames 5- --resolution 8 --devices cpu --json " + path("f.json"));
  ASSERT_EQ(from_5.code, 0) << from_5.text;
  const nlohmann::json frames = read_json("f.json")["frames"];
  EXPECT_EQ(frames.size(), 300U);
  EXPECT_EQ(frames[0]["tick"], 5);
}

/// EGL without a driver is as a machine without one.
TEST_F(Cli, WithoutOpenGLTheWayToRunIsNamed) {
  const std::string scene =
      write("one.yaml", "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n");
  const std::string run = "run " + scene + " --devices cpu --frames 1 --out " + path("out");
  ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", path("nothing.json").c_str(), 1);
  const Outcome pictures = run_tactus(run), none = run_tactus(run + " --view none");
  ::unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
  EXPECT_EQ(pictures.code, 1) << pictures.text;
  EXPECT_NE(pictures.text.find("draws its pictures with OpenGL 4.5, which is not here: "), std::string::npos)
      << pictures.text;
  EXPECT_NE(pictures.text.find("--view none runs the scene without pictures"), std::string::npos)
      << pictures.text;
  EXPECT_EQ(none.code, 0) << none.text;
}

/// A body that is crushed points to what explains it.
TEST_F(Cli, ARunWhoseBodiesAreCrushedSaysSo) {
  const std::string scene = write(
      "crush.yaml",
      "source: {kind: synthetic, figure: sphere, scale: 0.2, offset_m: [0.8, 0, 0], depth_cameras: 0, "
      "frames: 0-14}\n"
      "reconstruction: {resolution: 8}\ngravity_m_s2: [0, 0, 0]\nbodies:\n"
      "  - name: bar\n    contact: false\n    shape: {kind: box, size_m: [0.2, 0.1, 0.1]}\n    spacing_m: "
      "0.05\n"
      "    material: {model: tled, young_modulus_pa: 100000, poisson_ratio: 0.3}\n"
      "    fixed: [{kind: half_space, point_m: [-0.09, 0, 0], normal: [1, 0, 0]}]\n"
      "    moved:\n      - kind: half_space\n        point_m: [0.09, 0, 0]\n        normal: [-1, 0, 0]\n"
      "        path: [{time_s: 0.4, displacement_m: [-0.195, 0, 0]}]\n");
  const std::string run = "run " + scene + " --devices cpu --view none";
  const Outcome o = run_tactus(run);
  ASSERT_EQ(o.code, 0) << o.text;
  EXPECT_NE(o.text.find("crushed to less than 0.3 of their volume, or worse: 'bar'"), std::string::npos)
      << o.text;
  EXPECT_NE(o.text.find("--explain' says in which frames"), std::string::npos) << o.text;
  const Outcome explained = run_tactus(run + " --explain");
  EXPECT_EQ(explained.text.find("--explain' says"), std::string::npos) << explained.text;
}

TEST_F(Cli, QuietAndVerboseChangeWhatIsToldNotTheResult) {
  const std::string film = path("film");
  run_tactus("synth hand --cameras 2 --depth-cameras 0 --no-colors --out " + film);
  const std::string masks = "reconstruct --source masks " + film + "/rig.yaml --resolution 48 --devices cpu";
  EXPECT_NE(run_tactus(masks).text.find("warning: two cameras"), std::string::npos);
  const Outcome quiet = run_tactus(masks + " --quiet");
  EXPECT_EQ(quiet.code, 0) << quiet.text;
  EXPECT_EQ(quiet.text.find("warning"), std::string::npos) << quiet.text;
  EXPECT_NE(quiet.text.find("triangles"), std::string::npos) << quiet.text;
  EXPECT_EQ(run_tactus(masks + " --quiet --verbose").code, 2);

  const std::string scene =
      write("one.yaml",
            "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n"
            "bodies:\n  - {name: block, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  const std::string once = "run " + scene + " --devices cpu --frames 1 --view none --out " + path("out");
  EXPECT_EQ(run_tactus(once).text.find("frame 0 "), std::string::npos);
  const Outcome loud = run_tactus(once + " --verbose");
  EXPECT_EQ(loud.code, 0) << loud.text;
  EXPECT_NE(loud.text.find("frame 0 "), std::string::npos) << loud.text;
  EXPECT_NE(loud.text.find("body 'block': "), std::string::npos) << loud.text;
}

TEST_F(Cli, ScenesWithMistakesAreRefusedWithTheLine) {
  const std::string scene =
      write("bad.yaml", "source: {kind: synthetic, figure: hand}\nreconstruction:\n  resoluton: 64\n");
  const Outcome o = run_tactus("run " + scene + " --devices cpu --view none");
  EXPECT_EQ(o.code, 2);
  EXPECT_NE(o.text.find("bad.yaml:3"), std::string::npos) << o.text;
  EXPECT_NE(o.text.find("did you mean 'resolution'?"), std::string::npos) << o.text;
}

TEST_F(Cli, InterruptedRunsLeaveWholeFiles) {
  const Outcome o = run_and_signal({"reconstruct", "--source", "synthetic", "hand", "--moving", "--frames",
                                    "0-", "--devices", "cpu", "--resolution", "32", "--json", path("i.json")},
                                   "\n     1 ", SIGINT);
  EXPECT_EQ(o.code, 130) << o.text;
  EXPECT_GE(read_json("i.json")["frames"].size(), 2U);  // the row of frame 1 was printed
}

}  // namespace
}  // namespace tactus::test
