// Completions of bash, zsh and fish, from the verbs' own flags.
#include "tactus/base/error.h"
#include "tactus/cli/help/help_texts.h"
#include "tactus/cli/help/verb_words.h"

namespace tactus {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : " ") + w;
  return text;
}

std::vector<std::string> names_of(const std::vector<VerbWords>& verbs) {
  std::vector<std::string> names;
  for (const VerbWords& v : verbs) names.push_back(v.name);
  return names;
}

std::vector<std::string> names_of(const std::vector<FlagWords>& flags) {
  std::vector<std::string> names;
  for (const FlagWords& f : flags) names.push_back(f.name);
  return names;
}

bool takes_scene(const VerbWords& verb) { return verb.path == "run"; }

/// Words that complete a verb: its own verbs, or those of its first argument.
std::vector<std::string> first_words(const VerbWords& verb) {
  if (!verb.verbs.empty()) return names_of(verb.verbs);
  return verb.arguments.empty() ? std::vector<std::string>{} : verb.arguments.front().words;
}

bool takes_files(const VerbWords& verb) {
  if (verb.arguments.empty()) return false;
  const FlagWords& first = verb.arguments.front();
  return first.value == ValueKind::file || first.name == "what";  // a figure, or a file
}

// --- bash

constexpr const char* kBashHead = R"bash(# bash completion for tactus, as `tactus completion bash` prints it.
_tactus() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} verb=${COMP_WORDS[1]} flags= words= files=
  [ "$COMP_CWORD" -eq 1 ] && verb=
  case $verb in @NESTED@) [ "$COMP_CWORD" -gt 2 ] && verb="$verb ${COMP_WORDS[2]}" ;; esac
  case "$verb $prev" in
)bash";

constexpr const char* kBashTail = R"bash(  esac
  if [[ $cur == -* || -z $verb ]]; then words="$words $flags"; fi
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  [[ $cur == -* ]] && return
  case $files in
    scene) COMPREPLY+=($(compgen -f -X '!*.yaml' -- "$cur") $(compgen -d -- "$cur") $(_tactus_scenes "${COMP_WORDS[0]}" "$cur")) ;;
    any) COMPREPLY+=($(compgen -f -- "$cur")) ;;
  esac
}
# Scenes of the source tree and of the installation, wherever one stands.
_tactus_scenes() {
  local bin folder
  bin=$(dirname "$(command -v "$1")") 2>/dev/null
  for folder in scenes "$bin/../scenes" "$bin/../share/tactus/scenes"; do
    compgen -f -X '!*.yaml' -- "$folder/${2##*/}"
  done 2>/dev/null | grep -F -- "$2"
}
complete -o filenames -F _tactus tactus
)bash";

void add_bash_values(const VerbWords& verb, std::string& text) {
  for (const FlagWords& f : verb.flags) {
    if (f.value == ValueKind::none) continue;
    std::string reply;
    if (f.value == ValueKind::words)
      reply = "COMPREPLY=($(compgen -W \"" + joined(f.words) + "\" -- \"$cur\")); ";
    if (f.value == ValueKind::file) reply = "COMPREPLY=($(compgen -f -- \"$cur\")); ";
    text += "    \"" + verb.path + " " + f.name + "\") " + reply + "return ;;\n";
  }
  for (const VerbWords& below : verb.verbs) add_bash_values(below, text);
}

void add_bash_words(const VerbWords& verb, std::string& text) {
  const char* files = takes_scene(verb) ? "scene" : takes_files(verb) ? "any" : "";
  text += "    \"" + verb.path + "\") flags=\"" + joined(names_of(verb.flags)) + "\" words=\"" +
          joined(first_words(verb)) + "\" files=" + files + " ;;\n";
  for (const VerbWords& below : verb.verbs) add_bash_words(below, text);
}

std::string bash_completion(const VerbWords& program) {
  std::string nested;
  for (const VerbWords& v : program.verbs)
    if (!v.verbs.empty()) nested += (nested.empty() ? "" : "|") + v.name;
  std::string text = kBashHead;
  text.replace(text.find("@NESTED@"), 8, nested);
  add_bash_values(program, text);
  text += "  esac\n  case $verb in\n";
  add_bash_words(program, text);
  return text + kBashTail;
}

// --- zsh

std::string zsh_quoted(const std::string& text, const std::string& special) {
  std::string out;
  for (const char c : one_line(text)) {
    if (c == '\'')
      out += "'\\''";
    else if (special.find(c) != std::string::npos)
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

std::string zsh_value(const FlagWords& flag, const VerbWords& verb) {
  const std::string name = flag.name.substr(flag.name.find_first_not_of('-'));
  if (takes_scene(verb) && flag.name == "scene") return ":scene:_files -g \"*.yaml\"";
  if (flag.value == ValueKind::words && flag.name == "what")
    return ":" + name + ":{ compadd " + joined(flag.words) + "; _files }";
  if (flag.value == ValueKind::words) return ":" + name + ":(" + joined(flag.words) + ")";
  return ":" + name + ":" + (flag.value == ValueKind::file ? "_files" : " ");
}

void add_zsh_verb(const VerbWords& verb, const std::string& indent, std::string& text) {
  if (!verb.verbs.empty()) {
    text += indent + "if (( CURRENT == 2 )) && [[ $words[2] != -* ]]; then\n" + indent + "  local -a verbs=(";
    for (const VerbWords& v : verb.verbs)
      text += "\n" + indent + "    '" + v.name + ":" + zsh_quoted(v.help, ":\\") + "'";
    text += ")\n" + indent + "  _describe -t verbs verb verbs\n" + indent + "  return\n" + indent + "fi\n";
    text += indent + "case $words[2] in\n";
    for (const VerbWords& v : verb.verbs) {
      text += indent + "  " + v.name + ")\n" + indent + "    shift words; (( CURRENT-- ))\n";
      add_zsh_verb(v, indent + "    ", text);
      text += indent + "    ;;\n";
    }
    text += indent + "  *)\n";
  }
  text += indent + "    _arguments -S";
  for (const FlagWords& f : verb.flags) {
    text += " \\\n" + indent + "      '" + f.name + "[" + zsh_quoted(f.help, "[]\\") + "]";
    if (f.value != ValueKind::none) text += zsh_value(f, verb);
    text += "'";
  }
  for (std::size_t a = 0; a < verb.arguments.size(); ++a) {
    const bool last = a + 1 == verb.arguments.size();
    text += " \\\n" + indent + "      '" + (last ? "*:" : std::to_string(a + 1) + ":") +
            zsh_value(verb.arguments[a], verb).substr(1) + "'";
  }
  text += "\n";
  if (!verb.verbs.empty()) text += indent + "    ;;\n" + indent + "esac\n";
}

std::string zsh_completion(const VerbWords& program) {
  std::string text = "#compdef tactus\n# As `tactus completion zsh` prints it.\n_tactus() {\n";
  add_zsh_verb(program, "  ", text);
  return text +
         "}\nif [[ $zsh_eval_context[-1] == loadautofunc ]]; then _tactus \"$@\"; else compdef _tactus "
         "tactus; fi\n";
}

// --- fish

std::string fish_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : one_line(text)) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

constexpr const char* kFishHead = R"fish(# fish completion for tactus, as `tactus completion fish` prints it.
# Whether the line goes on after these verbs.
function __tactus_after
  set -l words (commandline -opc)
  set -l last (math (count $argv) + 1)
  test (count $words) -ge $last; and test "$words[2..$last]" = "$argv"
end
function __tactus_first
  test (count (commandline -opc)) -eq 1
end
complete -c tactus -f
)fish";

void add_fish_verb(const VerbWords& verb, std::string& text) {
  const std::string after = verb.path.empty() ? "__tactus_first" : "'__tactus_after " + verb.path + "'";
  for (const VerbWords& v : verb.verbs)
    text += "complete -c tactus -n " + after + " -a " + v.name + " -d " + fish_quoted(v.help) + "\n";
  for (const FlagWords& f : verb.flags) {
    text += "complete -c tactus -n " + after + " -l " + f.name.substr(2) + " -d " + fish_quoted(f.help);
    if (f.value == ValueKind::words) text += " -x -a '" + joined(f.words) + "'";
    if (f.value == ValueKind::number) text += " -x";
    if (f.value == ValueKind::file) text += " -r -F";
    text += "\n";
  }
  if (verb.verbs.empty() && !verb.path.empty()) {
    if (const std::string words = joined(first_words(verb)); !words.empty())
      text += "complete -c tactus -n " + after + " -a '" + words + "'\n";
    if (takes_files(verb)) text += "complete -c tactus -n " + after + " -F\n";
  }
  for (const VerbWords& v : verb.verbs) add_fish_verb(v, text);
}

}  // namespace

std::string shell_completion(const CLI::App& app, const std::string& shell) {
  const VerbWords program = words_of(app);
  if (shell == "bash") return bash_completion(program);
  if (shell == "zsh") return zsh_completion(program);
  if (shell == "fish") {
    std::string text = kFishHead;
    add_fish_verb(program, text);
    return text;
  }
  const std::string known[] = {"bash", "zsh", "fish"};
  throw usage_error("no completion for the shell '" + shell + "'" + suggestion(shell, known));
}

}  // namespace tactus
