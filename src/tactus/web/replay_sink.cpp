#include "tactus/web/replay_sink.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/byte_io.h"
#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/web/json_text.h"
#include "tactus/web/replay_bytes.h"
#include "tactus/web/web_files.h"

namespace tactus {
namespace {

constexpr float kCoarseSteps = 4095, kSteps = 65535;

/// With seven times its size on every side: movers stay in it, and its vertices can be told by
/// differences.
StreamGrid roomy(const StreamGrid& tight) {
  const float side_m = kSteps * tight.step_m;
  return {tight.origin_m - Vec3f{7 * side_m, 7 * side_m, 7 * side_m}, side_m / kCoarseSteps};
}

bool holds(const StreamGrid& grid, const StreamGrid& tight) {
  const float side_m = kSteps * tight.step_m, whole_m = kSteps * grid.step_m;
  // A thing that became much smaller would show too little.
  if (side_m < 0.25F * kCoarseSteps * grid.step_m) return false;
  for (int a = 0; a < 3; ++a) {
    const float from_m = tight.origin_m[a] - grid.origin_m[a];
    if (!(from_m >= 0 && from_m + side_m <= whole_m)) return false;
  }
  return true;
}

/// Six bits of each half of a normal are enough for the eye.
void coarsen_normals(std::string& vertices) {
  for (std::size_t i = 6; i < vertices.size(); i += 8)
    for (std::size_t k = i; k < i + 2; ++k) {
      const auto exact = static_cast<std::int8_t>(vertices[k]);
      vertices[k] = static_cast<char>(std::clamp(4 * static_cast<int>(std::lround(exact / 4.0)), -124, 124));
    }
}

void put_message(std::string& to, const std::string& message) {
  put_bytes(to, static_cast<std::uint32_t>(message.size()));
  to += message;
}

}  // namespace

ReplaySink::ReplaySink(StreamScene scene, std::string path, std::size_t most_bytes)
    : scene_(std::move(scene)),
      path_(std::move(path)),
      most_bytes_(most_bytes),
      status_(scene_.held(), scene_.facts().budget_s) {
  if (const std::string missing = web_page_missing(); !missing.empty())
    throw Error("--report '" + path_ + "' needs the page, which this program was built without: " + missing);
  output_is_writable(path_);
}

void ReplaySink::begin(const World& /*world*/, std::optional<int> frame_count) {
  status_.set_frames_in_all(frame_count);
}

void ReplaySink::frame(RunFrame& frame) {
  ++frames_;
  const bool is_kept = (frames_ - 1) % every_ == 0;
  const std::shared_ptr<const std::string> status = status_.look(frame);
  if (!is_kept) return;
  worker_.add([this, snapshot = frame.snapshot(),
               kept = Frame{frame.number, frame.images.time_s, status, {}}] { keep(*snapshot, kept); });
}

ReplaySink::Block ReplaySink::block_of(BlockKind kind, const BlockStyle& style,
                                       std::span<const Vec3f> positions_m, std::span<const Vec3f> normals) {
  Block block{kind, style.role, std::string(style.name), style.color, style.opacity};
  const StreamGrid tight = StreamGrid::around(positions_m);
  StreamGrid& grid = grids_.try_emplace(block.key(), roomy(tight)).first->second;
  if (!holds(grid, tight)) grid = roomy(tight);
  block.grid = grid;
  if (normals.size() == positions_m.size() && !normals.empty()) {
    put_vertices(block.vertices, positions_m, normals, grid);
    coarsen_normals(block.vertices);
    block.flags = kHasNormals;
  } else {
    put_vertices(block.vertices, positions_m, {}, grid);
  }
  return block;
}

void ReplaySink::keep(const FrameSnapshot& snapshot, Frame frame) {
  for (StreamScene::Surface& surface : scene_.surfaces(snapshot, creases_, false)) {
    if (surface.is_sheet) {
      Block& block = frame.blocks.emplace_back(Block{BlockKind::surface, surface.style.role,
                                                     std::string(surface.style.name), surface.style.color,
                                                     surface.style.opacity});
      block.sheet = &sheets_[block.key()];
      block.film = block.sheet->add(surface.mesh, surface.film);
      continue;
    }
    Block block = block_of(BlockKind::surface, surface.style, surface.mesh.positions_m, surface.mesh.normals);
    std::shared_ptr<const Triangles>& shown = shown_[block.key()];
    if (shown == nullptr || *shown != surface.mesh.triangles)
      shown = std::make_shared<const Triangles>(std::move(surface.mesh.triangles));
    block.triangles = shown;
    block.film = std::move(surface.film);
    if (!block.film.empty()) block.flags |= kHasFilm;
    frame.blocks.push_back(std::move(block));
  }
  for (const StreamScene::Points& points : scene_.points(snapshot))
    frame.blocks.push_back(block_of(points.kind, points.style, points.positions_m, {}));
  kept_.push_back(std::move(frame));
  if (kept_.size() > kMostFrames) halve();
}

void ReplaySink::spread_sheets() {
  std::map<FilmSheet*, Block> all;
  for (Frame& frame : kept_)
    for (Block& block : frame.blocks) {
      if (block.sheet == nullptr) continue;
      FilmSheet& sheet = *block.sheet;
      auto whole = all.find(&sheet);
      if (whole == all.end()) {
        const BlockStyle style{block.role, block.name, block.color, block.opacity};
        whole = all.emplace(&sheet, block_of(BlockKind::surface, style, sheet.positions_m(), sheet.normals()))
                    .first;
      }
      block.grid = whole->second.grid;
      block.vertices = whole->second.vertices;
      block.triangles = sheet.triangles();
      block.film.resize(sheet.positions_m().size(), '\0');
      block.flags = whole->second.flags | kHasFilm | kWetAlone;
    }
}

void ReplaySink::halve() {
  std::deque<Frame> left;
  for (std::size_t i = 0; i < kept_.size(); i += 2) left.push_back(std::move(kept_[i]));
  kept_ = std::move(left);
  every_ = 2 * every_;
}

std::string ReplaySink::packed_frame(const Frame& frame, std::map<std::string, const Block*>& before) {
  StreamMessage message(StreamKind::frame, static_cast<std::uint32_t>(frame.number), frame.time_s, 0);
  std::map<std::string, const Block*> now;
  for (const Block& block : frame.blocks) {
    std::string key = block.key();
    while (now.contains(key)) key += '+';
    now[key] = &block;
    const auto found = before.find(key);
    const Block* last = found == before.end() ? nullptr : found->second;
    const bool same_triangles =
        block.kind == BlockKind::surface && last != nullptr && last->triangles == block.triangles;
    // Particles keep their numbers, and new ones come last.
    const bool differs =
        last != nullptr && last->grid == block.grid && (same_triangles || block.kind == BlockKind::particles);
    std::string then;
    if (differs) {
      then = last->vertices;
      then.resize(block.vertices.size(), '\0');
    }
    const std::uint32_t flags =
        block.flags | kPacked | (same_triangles ? kSameTriangles : 0U) | (differs ? kDifference : 0U);
    const bool has_triangles = !same_triangles && block.triangles != nullptr;
    const std::size_t count = block.vertices.size() / 8;
    message.add_packed(block.kind, {block.role, block.name, block.color, block.opacity}, count,
                       has_triangles ? block.triangles->size() : 0,
                       pack_vertices(block.vertices, then) +
                           (has_triangles ? pack_corners(*block.triangles) : std::string()) +
                           (differs ? pack_film(block.film, last->film) : block.film),
                       block.grid, flags);
  }
  if (frame.status) message.add_json({BlockRole::status, "status"}, *frame.status);
  before = std::move(now);
  return message.take();
}

std::string ReplaySink::messages(const std::string& summary) const {
  std::string all;
  put_message(all, scene_.setting(false));
  StreamMessage end(StreamKind::summary, 0, 0, 0);
  end.add_json({BlockRole::status, "summary"}, summary);
  put_message(all, end.take());
  std::map<std::string, const Block*> before;
  for (const Frame& frame : kept_) put_message(all, packed_frame(frame, before));
  return all;
}

void ReplaySink::end(RunNotices& notices) {
  worker_.finish();
  spread_sheets();
  nlohmann::json summary{{"frames", frames_}, {"statuses", notices.statuses()}};
  summary["notices"] = nlohmann::json::array();
  for (const Notice& n : notices.notices())
    summary["notices"].push_back(
        {{"code", n.code}, {"severity", severity_text(n.severity)}, {"text", n.text}, {"remedy", n.remedy}});
  while (true) {
    summary["every"] = every_.load();
    const std::string page = replay_page(messages(json_text(summary)));
    if (page.size() > most_bytes_ && kept_.size() > 2) {
      halve();
      continue;
    }
    write_file(path_, page);
    bytes_ = page.size();
    return;
  }
}

}  // namespace tactus
