#pragma once
/// Kinds of frame sources, by their words in scenes and after `--source`. A new kind: a line here, and a case
/// in data_sources.cpp that opens it.
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace tactus {

enum class SourceKind : std::uint8_t { synthetic, videos, masks, middlebury, kinect, recording, live, none };

inline constexpr std::pair<const char*, SourceKind> kSourceKinds[] = {
    {"synthetic", SourceKind::synthetic}, {"videos", SourceKind::videos},
    {"masks", SourceKind::masks},         {"middlebury", SourceKind::middlebury},
    {"kinect", SourceKind::kinect},       {"recording", SourceKind::recording},
    {"live", SourceKind::live},           {"none", SourceKind::none}};

const char* word_of(SourceKind kind);
/// "videos, masks or kinect".
std::string words_of(std::span<const SourceKind> kinds);
/// "synthetic, videos, masks, middlebury, kinect, recording or live": those that film.
std::string source_kind_words();
/// One of these. @throws usage Error naming the word, with the nearest one.
SourceKind source_kind(const std::string& word);

}  // namespace tactus
