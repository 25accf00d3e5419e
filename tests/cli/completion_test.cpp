// Completions and the man page offer exactly what the program takes.
#include <cstdio>
#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

using Words = std::set<std::string>;

Words words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Flags in a help text, `-h` aside.
Words flags_of(const std::string& help) {
  Words flags;
  const std::regex flag("(^|\n)  (-h,)?(--[a-z-]+)");
  for (std::sregex_iterator m(help.begin(), help.end(), flag), end; m != end; ++m) flags.insert((*m)[3]);
  return flags;
}

/// "a, b, c" after "known: " in the message that a word near nothing gets.
Words known_of(const std::string& arguments) {
  const std::string text = run_tactus(arguments).text;
  const auto begin = text.find("known: ");
  if (begin == std::string::npos) return {};
  std::string list = text.substr(begin + 7, text.find('\n', begin) - begin - 7);
  std::replace(list.begin(), list.end(), ',', ' ');
  return words_of(list);
}

class Completion : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (!IsSkipped()) write("tactus.bash", run_tactus("completion bash").text);
  }
  std::string script() const { return path("tactus.bash"); }
  /// What is offered for the last word of the line, in an empty folder.
  Words offered(const std::vector<std::string>& line) const {
    std::string words;
    for (const std::string& word : line) words += " '" + word + "'";
    std::filesystem::create_directories(path("empty"));
    const std::string command = "cd '" + path("empty") + "' && bash -c \"source '" + script() +
                                "'; COMP_WORDS=(" + words +
                                "); COMP_CWORD=" + std::to_string(line.size() - 1) +
                                "; _tactus; printf '%s\\n' \\\"\\${COMPREPLY[@]}\\\"\"";
    FILE* pipe = popen(command.c_str(), "r");
    std::string text;
    char buffer[4096];
    while (const std::size_t n = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
    EXPECT_EQ(pclose(pipe), 0) << command;
    return words_of(text);
  }
};

Words verbs() {
  std::string help = run_tactus("--help").text;
  help = help.substr(help.find("Subcommands:"));
  Words found;
  const std::regex verb("\n  ([a-z]+) ");
  for (std::sregex_iterator m(help.begin(), help.end(), verb), end; m != end; ++m) {
    if (help.substr(0, static_cast<std::size_t>(m->position())).find("Examples") == std::string::npos)
      found.insert((*m)[1]);
  }
  found.erase("tactus");
  return found;
}

TEST_F(Completion, OffersEveryVerbAndGlobalFlag) {
  Words expected = verbs();
  EXPECT_TRUE(expected.contains("reconstruct") && expected.contains("bench"));
  for (const std::string& flag : flags_of(run_tactus("--help").text)) expected.insert(flag);
  EXPECT_EQ(offered({program(), ""}), expected);
  EXPECT_EQ(offered({program(), "recon"}), Words{"reconstruct"});
}

TEST_F(Completion, OffersEveryFlagOfEveryVerb) {
  for (const std::string& verb : verbs()) {
    const Words flags = flags_of(run_tactus(verb + " --help").text);
    EXPECT_TRUE(flags.contains("--help")) << verb;
    EXPECT_EQ(offered({program(), verb, "--"}), flags) << verb;
  }
}

TEST_F(Completion, OffersEveryBenchmarkSourceAndFigure) {
  const auto without_flags = [](Words words) {
    std::erase_if(words, [](const std::string& w) { return w.starts_with("-"); });
    return words;
  };
  const Words benchmarks = known_of("bench zzzzzzzz"), kinds = known_of("reconstruct --source zzzzzzzz x"),
              figures = known_of("reconstruct zzzzzzzz");
  EXPECT_TRUE(benchmarks.contains("all") && kinds.contains("masks") && figures.contains("hand"));
  EXPECT_EQ(without_flags(offered({program(), "bench", ""})), benchmarks);
  EXPECT_EQ(offered({program(), "reconstruct", "--source", ""}), kinds);
  EXPECT_EQ(without_flags(offered({program(), "reconstruct", ""})), figures);
  EXPECT_EQ(without_flags(offered({program(), "synth", ""})), figures);
  EXPECT_EQ(without_flags(offered({program(), "noise", "ra"})), Words{"rabbit"});
  EXPECT_EQ(offered({program(), "run", "--view", ""}), (Words{"file", "none"}));
}

TEST_F(Completion, OffersVerbsOfVerbs) {
  EXPECT_EQ(offered({program(), "calibrate", ""}), (Words{"intrinsics", "rig", "tof"}));
  EXPECT_TRUE(offered({program(), "calibrate", "rig", "--"}).contains("--floor"));
  EXPECT_TRUE(offered({program(), "help", "recon"}).contains("reconstruct"));
  EXPECT_EQ(offered({program(), "completion", ""}), (Words{"bash", "zsh", "fish"}));
}

/// Every verb and every flag is in the scripts of the other shells and in the man page, and these shells read
/// them.
TEST_F(Completion, OtherShellsAndTheManPageKnowEveryFlag) {
  const std::string zsh = run_tactus("completion zsh").text, fish = run_tactus("completion fish").text,
                    man = run_tactus("help --man").text;
  const auto in_man = [](std::string flag) {
    for (std::size_t at = 0; (at = flag.find('-', at)) != std::string::npos; at += 2) flag.insert(at, "\\");
    return "\\fB" + flag + "\\fR";
  };
  for (const std::string& verb : verbs()) {
    EXPECT_NE(zsh.find("'" + verb + ":"), std::string::npos) << verb;
    EXPECT_NE(fish.find(" -a " + verb + " -d "), std::string::npos) << verb;
    EXPECT_NE(man.find(".SS " + verb + "\n"), std::string::npos) << verb;
    for (const std::string& flag : flags_of(run_tactus(verb + " --help").text)) {
      EXPECT_NE(zsh.find("'" + flag + "["), std::string::npos) << verb << " " << flag;
      EXPECT_NE(fish.find("'__tactus_after " + verb + "' -l " + flag.substr(2) + " "), std::string::npos)
          << verb << " " << flag;
      EXPECT_NE(man.find(in_man(flag)), std::string::npos) << verb << " " << flag;
    }
  }
  write("_tactus", zsh);
  write("tactus.fish", fish);
  write("tactus.1", man);
  for (const auto& [shell, file] : {std::pair{"zsh", "_tactus"}, std::pair{"fish", "tactus.fish"}}) {
    if (std::system((std::string("command -v ") + shell + " >/dev/null").c_str()) != 0) continue;
    EXPECT_EQ(std::system((std::string(shell) + " -n " + path(file)).c_str()), 0) << shell;
  }
}

/// Scenes below `scenes/` and beside the program are offered, wherever one stands.
TEST_F(Completion, OffersScenes) {
  std::filesystem::create_directories(path("empty/scenes"));
  write("empty/scenes/mine.yaml", "");
  write("empty/scenes/notes.txt", "");
  EXPECT_TRUE(offered({program(), "run", ""}).contains("scenes/mine.yaml"));
  EXPECT_FALSE(offered({program(), "run", ""}).contains("scenes/notes.txt"));
  EXPECT_TRUE(offered({program(), "run", "scenes/m"}).contains("scenes/mine.yaml"));
}

}  // namespace
}  // namespace tactus::test
