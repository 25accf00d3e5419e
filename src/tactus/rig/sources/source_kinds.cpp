#include "tactus/rig/sources/source_kinds.h"

#include <vector>

#include "tactus/base/error.h"

namespace tactus {

const char* word_of(SourceKind kind) {
  for (const auto& [word, k] : kSourceKinds) {
    if (k == kind) return word;
  }
  return "";
}

std::string words_of(std::span<const SourceKind> kinds) {
  std::string text;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (i > 0) text += i + 1 == kinds.size() ? " or " : ", ";
    text += word_of(kinds[i]);
  }
  return text;
}

std::string source_kind_words() {
  std::vector<SourceKind> all;
  for (const auto& entry : kSourceKinds)
    if (entry.second != SourceKind::none) all.push_back(entry.second);
  return words_of(all);
}

SourceKind source_kind(const std::string& word) {
  std::vector<std::string> words;
  for (const auto& [w, kind] : kSourceKinds) {
    if (kind == SourceKind::none) continue;
    if (word == w) return kind;
    words.emplace_back(w);
  }
  throw usage_error("--source '" + word + "' is unknown" + suggestion(word, words));
}

}  // namespace tactus
