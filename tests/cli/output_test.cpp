// Where results go: devices, pipes, links, standard output, full disks, a folder that another run uses.
#include <sys/stat.h>

#include <fstream>
#include <opencv2/videoio.hpp>

#include "cli/program.h"
#include "support/sliced_block.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Exit code and output of a shell's line in which TACTUS stands for the program.
Outcome shell(std::string line) {
  for (std::size_t at = 0; (at = line.find("TACTUS", at)) != std::string::npos; at += program().size())
    line.replace(at, 6, program());
  FILE* pipe = popen(("{ " + line + "; } 2>&1").c_str(), "r");
  std::string text;
  char buffer[4096];
  while (const std::size_t n = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

class Output : public ProgramTest {
 protected:
  static constexpr const char* kHull = "TACTUS reconstruct sphere --resolution 8 --devices cpu ";
  std::string scene() const {
    return write("s.yaml",
                 "source: {kind: synthetic, figure: hand}\nreconstruction: {resolution: 16}\n"
                 "view: {size_px: [320, 240]}\n");
  }
};

TEST_F(Output, FullStandardOutputIsAFailure) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  for (const char* arguments : {"info", "--version", "info --help", "bench --help"}) {
    const Outcome o = shell(std::string("TACTUS ") + arguments + " > /dev/full");
    EXPECT_EQ(o.code, 1) << arguments;
    EXPECT_TRUE(has(o.text, "error: can't write standard output: ")) << o.text;
  }
  EXPECT_EQ(shell("TACTUS info > " + path("info.txt")).code, 0);
}

/// With standard output closed, the first file that was opened got what was printed.
TEST_F(Output, ClosedStandardOutputIsAFailureAndHarmsNoFile) {
  const Outcome o = shell(kHull + std::string("--json ") + path("r.json") + " >&-");
  EXPECT_EQ(o.code, 1);
  EXPECT_TRUE(has(o.text, "error: can't write standard output: ")) << o.text;
  EXPECT_EQ(read_json("r.json")["frames"].size(), 1U);
}

TEST_F(Output, DevicesStayDevices) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const Outcome full = shell(kHull + std::string("--json /dev/full"));
  EXPECT_EQ(full.code, 1);
  EXPECT_TRUE(has(full.text, "error: can't write '/dev/full': No space left on device")) << full.text;
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  // /dev/null has no extension that names a format, a link to it has.
  fs::create_symlink("/dev/null", path("null.ply"));
  EXPECT_EQ(shell(kHull + std::string("--json /dev/null --mesh ") + path("null.ply")).code, 0);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::is_symlink(path("null.ply")));
}

TEST_F(Output, FifoReachesItsReader) {
  ASSERT_EQ(mkfifo(path("f.json").c_str(), 0600), 0);
  const Outcome o = shell("cat " + path("f.json") + " > " + path("got.json") + " & " + kHull + "--json " +
                          path("f.json") + " && wait");
  EXPECT_EQ(o.code, 0) << o.text;
  EXPECT_EQ(read_json("got.json")["frames"].size(), 1U);
  EXPECT_TRUE(fs::is_fifo(path("f.json")));
}

TEST_F(Output, DashIsStandardOutputAndNothingElseIsPrintedThere) {
  EXPECT_EQ(shell(kHull + std::string("--json - > ") + path("r.json")).code, 0);
  EXPECT_EQ(read_json("r.json")["frames"].size(), 1U);
  EXPECT_EQ(shell("TACTUS info --json - > " + path("i.json")).code, 0);
  EXPECT_TRUE(read_json("i.json").contains("devices"));
  EXPECT_EQ(shell(kHull + std::string("--mesh - > ") + path("a.ply")).code, 0);
  EXPECT_EQ(shell(kHull + std::string("--mesh ") + path("b.ply")).code, 0);
  EXPECT_EQ(shell("cmp " + path("a.ply") + " " + path("b.ply")).text, "");
  expect_refused("reconstruct sphere --devices cpu --json - --mesh -", 2,
                 {"'-' (standard output) is given for two outputs, expected a file for one of them"});
  expect_refused("reconstruct hand --moving --frames 0-1 --devices cpu --mesh -", 2,
                 {"'-' (standard output) holds one frame; with --frames 0-1, give a file name"});
  const Outcome full = shell("TACTUS info --json - > /dev/full");
  EXPECT_EQ(full.code, 1);
  EXPECT_TRUE(has(full.text, "can't write '-': ")) << full.text;
}

/// As of a full disk; a limit of file size is one that every user can set.
TEST_F(Output, VideoThatTheDiskDidNotTakeIsAFailure) {
  const std::string run = "TACTUS run " + scene() + " --devices cpu --frames 10 --out " + path("out");
  const Outcome cut = shell("ulimit -f 4; " + run);  // blocks of 512 or 1024 bytes
  if (has(cut.text, "OpenGL")) GTEST_SKIP() << "no pictures here: " << cut.text;
  EXPECT_EQ(cut.code, 1) << cut.text;
  EXPECT_TRUE(has(cut.text, "error: can't write '" + path("out/s.mp4") + "': File too large")) << cut.text;
  EXPECT_FALSE(fs::exists(path("out/s.mp4")));
  EXPECT_EQ(shell(run).code, 0);
  EXPECT_EQ(cv::VideoCapture(path("out/s.mp4")).get(cv::CAP_PROP_FRAME_COUNT), 10);
}

TEST_F(Output, SecondRunInAFolderIsRefusedWithTheFirstOnesProcess) {
  const std::string out = path("out"), lock = out + "/.tactus.lock";
  const std::string run = "TACTUS run " + scene() + " --devices cpu --out " + out;
  const Outcome o =
      shell(run + " --frames 100000 > /dev/null 2>&1 & first=$!; i=0; while [ ! -s " + lock +
            " ] && [ $i -lt 300 ]; do sleep 0.1; i=$((i+1)); done; " + run +
            " --frames 1; code=$?; echo first was $first; kill $first; wait $first; exit $code");
  EXPECT_EQ(o.code, 1) << o.text;
  const std::size_t at = o.text.find("first was ");
  ASSERT_NE(at, std::string::npos) << o.text;
  const std::string first = o.text.substr(at + 10, o.text.find('\n', at) - at - 10);
  EXPECT_TRUE(has(o.text, "error: output folder '" + out + "': another run (process " + first +
                              ") writes into it; wait for its end or choose another folder"))
      << o.text;
  EXPECT_FALSE(fs::exists(lock));
}

TEST_F(Output, SynthLocksItsFolderToo) {
  fs::create_directories(path("set"));
  const Outcome o = shell("exec 9>" + path("set/.tactus.lock") +
                          "; flock 9; printf 4711 >&9; TACTUS synth sphere --out " + path("set"));
  EXPECT_EQ(o.code, 1) << o.text;
  EXPECT_TRUE(has(o.text, "another run (process 4711) writes into it")) << o.text;
}

/// A blade goes through a layer of 8 x 4 of 8 x 8 x 4 cubes: each becomes two copies, and each has the
/// layer's 9 x 5 nodes on the other wall to itself.
TEST_F(Output, VtkFilesShowABodyAsItIsCut) {
  const std::string scene = write("cut.yaml", std::string(kSlicedBlock) + "output: {vtk_every: 20}\n");
  const Outcome o =
      shell("TACTUS run " + scene + " --frames 21 --view none --devices cpu --out " + path("out"));
  ASSERT_EQ(o.code, 0) << o.text;
  const auto count = [&](const std::string& file, const std::string& of) {
    std::ifstream in(file);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    const std::size_t at = text.find(of + "=\"");
    return at == text.npos ? -1 : std::stoi(text.substr(at + of.size() + 2));
  };
  const std::string before = path("out/cut-block-00000.vtu"), after = path("out/cut-block-00020.vtu");
  EXPECT_EQ(count(before, "NumberOfPoints"), 9 * 9 * 5);
  EXPECT_EQ(count(before, "NumberOfCells"), 8 * 8 * 4);
  EXPECT_EQ(count(after, "NumberOfPoints"), 9 * 9 * 5 + 2 * 9 * 5);
  EXPECT_EQ(count(after, "NumberOfCells"), 8 * 8 * 4 + 8 * 4);
  EXPECT_EQ(files().size(), 6U) << "scene, two of the body, two of the filmed ball, the collection";
}

/// The same bytes as a run whose scene asks for them, though this scene asks for every second frame; and the
/// surfaces of a recording, without a scene.
TEST_F(Output, ExportWritesFilesOfScenesAndRecordings) {
  const auto text_of = [](const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  const std::string falls =
      write("s.yaml",
            "source: {kind: synthetic, figure: hand}\nreconstruction: {resolution: 16}\n"
            "bodies: [{name: b, shape: {kind: box, size_m: [0.04, 0.04, 0.04]}, spacing_m: 0.02}]\n"
            "output: {mesh_every: 2, vtk_every: 2, usd_every: 2}\n");
  const Outcome run = shell("TACTUS run " + falls + " --frames 3 --view none --devices cpu --out " +
                            path("run") + " --record " + path("hand.rec"));
  ASSERT_EQ(run.code, 0) << run.text;
  const Outcome same = shell("TACTUS export " + falls + " --to usd,vtk,ply --every 2 --frames 3 --out " +
                             path("same") + " --devices cpu");
  ASSERT_EQ(same.code, 0) << same.text;
  EXPECT_TRUE(has(same.text, "files: " + path("same"))) << same.text;
  std::size_t count = 0;
  for (const auto& file : fs::directory_iterator(path("run"))) {
    if (file.path().filename().string()[0] == '.') continue;
    ++count;
    EXPECT_EQ(text_of(path("same") + "/" + file.path().filename().string()), text_of(file.path()))
        << file.path();
  }
  EXPECT_EQ(count, 10U) << "surfaces and nodes of the body and of the hand, twice; one .pvd, one .usda";

  const Outcome hull =
      shell("TACTUS export " + path("hand.rec") + " --to ply --devices cpu --out " + path("hull"));
  ASSERT_EQ(hull.code, 0) << hull.text;
  EXPECT_TRUE(fs::exists(path("hull/hand-real-00000.ply"))) << hull.text;
  EXPECT_FALSE(fs::exists(path("hull/hand.usda")));
  EXPECT_EQ(shell("TACTUS export " + falls + " --to obj").code, 2);
}

}  // namespace
}  // namespace tactus::test
