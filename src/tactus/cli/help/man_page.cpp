// tactus(1), from the verbs' own help.
#include "tactus/cli/exit_codes.h"
#include "tactus/cli/help/help_texts.h"
#include "tactus/cli/help/verb_words.h"

namespace tactus {
namespace {

/// Text as troff takes it.
std::string plain(const std::string& text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    at_start = c == '\n';
  }
  return out;
}

std::string bold(const std::string& text) { return "\\fB" + plain(text) + "\\fR"; }

std::string value_of(const FlagWords& flag) {
  if (flag.value == ValueKind::none) return "";
  std::string words;
  for (const std::string& w : flag.words) words += (words.empty() ? "" : "|") + w;
  const char* kind = flag.value == ValueKind::number ? "NUMBER" : "TEXT";
  return " \\fI" + plain(words.empty() || words.size() > 60 ? kind : words) + "\\fR";
}

void add_flags(const VerbWords& verb, std::string& page) {
  for (const FlagWords& a : verb.arguments)
    page += ".TP\n\\fI" + plain(a.name) + "\\fR\n" + plain(a.help) + "\n";
  for (const FlagWords& f : verb.flags)
    page += ".TP\n" + bold(f.name) + value_of(f) + "\n" + plain(f.help) + "\n";
}

void add_verb(const VerbWords& verb, std::string& page) {
  std::string usage = bold("tactus " + verb.path);
  for (const FlagWords& a : verb.arguments) usage += " \\fI" + plain(a.name) + "\\fR";
  page += ".SS " + plain(verb.path) + "\n" + usage + "\n.br\n" + plain(verb.help) + "\n";
  add_flags(verb, page);
  if (!verb.examples.empty()) page += ".PP\n.nf\n" + plain(verb.examples) + "\n.fi\n";
  for (const VerbWords& below : verb.verbs) add_verb(below, page);
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& version) {
  const VerbWords program = words_of(app);
  std::string page = ".TH TACTUS 1 \"\" \"tactus " + version + "\" \"User Commands\"\n.SH NAME\ntactus \\- " +
                     plain(program.help.substr(program.help.find(':') + 2)) +
                     "\n.SH SYNOPSIS\n.B tactus\n\\fIverb\\fR [\\fIflags\\fR]\n";
  page +=
      ".SH DESCRIPTION\nCameras look at a workspace from several sides. Tactus rebuilds what they see in 3D, "
      "and the "
      "rebuilt surface pushes virtual soft bodies.\n";
  page += ".SH OPTIONS\n";
  add_flags(program, page);
  page += ".SH VERBS\n";
  for (const VerbWords& verb : program.verbs) add_verb(verb, page);
  page += ".SH EXIT STATUS\n";
  for (const ExitCode& e : kExitCodes)
    page += ".TP\n" + bold(std::to_string(e.code)) + "\n" + plain(e.meaning) + "\n";
  page +=
      ".SH SIGNALS\nSIGINT, SIGTERM and SIGHUP end a run after its frame: results so far are written. A "
      "second one "
      "ends it at once. Under\n.BR nohup (1)\nSIGHUP is ignored.\n";
  page +=
      ".SH ENVIRONMENT\n.TP\n.B TACTUS_DATA\nFolder of recordings and meshes that scenes name as "
      "$TACTUS_DATA.\n";
  page +=
      ".SH SEE ALSO\nThe documents that are installed beside the program: first_scene.md, scene.md, rig.md, "
      "results.md.\n";
  return page;
}

}  // namespace tactus
