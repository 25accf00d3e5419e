#include "tactus/reconstruct/texture/photo_atlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Index kMarginPx = 3;         // bilinear and a step of mipmaps stay within the page
constexpr Index kWhitePx = 4;          // the patch at the top left corner
constexpr Index kMaxHeightPx = 16384;  // limit of graphics hardware

/// A rectangle of a photo and where it lies in the atlas.
struct Page {
  Index x0 = 0, y0 = 0, x1 = -1, y1 = -1;  // of the photo, inclusive
  Index at_x = 0, at_y = 0;
  bool used() const { return x1 >= x0; }
  Index width() const { return x1 - x0 + 1; }
  Index height() const { return y1 - y0 + 1; }
};

void check(const TriangleMesh& mesh, std::span<const Index> triangle_cameras, std::span<const Rgb8> colors,
           std::span<const Camera> cameras, std::span<const ColorImage> photos) {
  if (triangle_cameras.size() != mesh.triangles.size() || colors.size() != mesh.positions_m.size() ||
      photos.size() != cameras.size() || mesh.normals.size() != mesh.positions_m.size())
    throw Error("photo atlas: " + std::to_string(mesh.triangles.size()) + " triangles with " +
                std::to_string(triangle_cameras.size()) + " choices, " +
                std::to_string(mesh.positions_m.size()) + " vertices with " +
                std::to_string(mesh.normals.size()) + " normals and " + std::to_string(colors.size()) +
                " colours, " + std::to_string(cameras.size()) + " cameras with " +
                std::to_string(photos.size()) + " photos");
  for (const Index c : triangle_cameras) {
    if (c < -1 || c >= static_cast<Index>(cameras.size()) ||
        (c >= 0 && photos[static_cast<std::size_t>(c)].empty()))
      throw Error("photo atlas: a triangle is cut from photo " + std::to_string(c) + ", which is not there");
  }
}

std::vector<Page> used_rectangles(const TriangleMesh& mesh, std::span<const Index> triangle_cameras,
                                  std::span<const Camera> cameras) {
  std::vector<Page> pages(cameras.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (triangle_cameras[t] < 0) continue;
    const auto c = static_cast<std::size_t>(triangle_cameras[t]);
    const Camera& camera = cameras[c];
    Page& page = pages[c];
    for (const Index v : mesh.triangles[t]) {
      const Pixel px = project(camera, vec_cast<double>(mesh.positions_m[static_cast<std::size_t>(v)]));
      const auto x = static_cast<Index>(std::lround(std::clamp(px.u_px, 0.0, camera.width_px - 1.0)));
      const auto y = static_cast<Index>(std::lround(std::clamp(px.v_px, 0.0, camera.height_px - 1.0)));
      if (!page.used()) page = {.x0 = x, .y0 = y, .x1 = x, .y1 = y};
      page.x0 = std::min(page.x0, x);
      page.y0 = std::min(page.y0, y);
      page.x1 = std::max(page.x1, x);
      page.y1 = std::max(page.y1, y);
    }
  }
  for (std::size_t c = 0; c < pages.size(); ++c) {
    if (!pages[c].used()) continue;
    pages[c].x0 = std::max(pages[c].x0 - kMarginPx, 0);
    pages[c].y0 = std::max(pages[c].y0 - kMarginPx, 0);
    pages[c].x1 = std::min(pages[c].x1 + kMarginPx, cameras[c].width_px - 1);
    pages[c].y1 = std::min(pages[c].y1 + kMarginPx, cameras[c].height_px - 1);
  }
  return pages;
}

/// Puts the pages on shelves, the highest first. Returns the size of the whole.
Vec2i pack(std::vector<Page>& pages) {
  std::vector<std::size_t> order(pages.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return pages[a].height() > pages[b].height(); });
  double area = 0;
  Index widest = kWhitePx;
  for (const Page& page : pages) {
    if (!page.used()) continue;
    area += static_cast<double>(page.width()) * page.height();
    widest = std::max(widest, page.width() + kWhitePx);
  }
  const Index width = std::max(widest, static_cast<Index>(std::ceil(std::sqrt(1.15 * area))));
  Index x = kWhitePx, y = 0, shelf = kWhitePx;
  for (const std::size_t c : order) {
    Page& page = pages[c];
    if (!page.used()) continue;
    if (x + page.width() > width) {
      x = 0;
      y += shelf;
      shelf = 0;
    }
    page.at_x = x;
    page.at_y = y;
    x += page.width();
    shelf = std::max(shelf, page.height());
  }
  if (y + shelf > kMaxHeightPx)
    throw Error("photo atlas: " + std::to_string(width) + "x" + std::to_string(y + shelf) + " px, at most " +
                std::to_string(kMaxHeightPx) + " px high");
  return {width, y + shelf};
}

}  // namespace

TexturedMesh make_photo_atlas(const TriangleMesh& mesh, std::span<const Index> triangle_cameras,
                              std::span<const Rgb8> colors, std::span<const Camera> cameras,
                              std::span<const ColorImage> photos) {
  check(mesh, triangle_cameras, colors, cameras, photos);
  std::vector<Page> pages = used_rectangles(mesh, triangle_cameras, cameras);
  const Vec2i size = pack(pages);
  TexturedMesh out;
  out.atlas = ColorImage(size.x, size.y, {255, 255, 255});
  for (std::size_t c = 0; c < pages.size(); ++c) {
    const Page& page = pages[c];
    for (Index y = 0; page.used() && y < page.height(); ++y)
      std::copy_n(&photos[c](page.x0, page.y0 + y), page.width(), &out.atlas(page.at_x, page.at_y + y));
  }
  // A vertex comes once per photo that its triangles are cut from; slot 0: from none.
  const std::size_t slots = cameras.size() + 1;
  std::vector<Index> place(mesh.positions_m.size() * slots, -1);
  out.mesh.triangles.reserve(mesh.triangles.size());
  const auto inverse_width = 1.0 / size.x, inverse_height = 1.0 / size.y;
  const auto vertex = [&](Index v, Index c) {
    const auto i = static_cast<std::size_t>(v);
    Index& at = place[i * slots + static_cast<std::size_t>(c + 1)];
    if (at >= 0) return at;
    at = static_cast<Index>(out.mesh.positions_m.size());
    Vec2<double> px{0.5 * kWhitePx, 0.5 * kWhitePx};
    if (c >= 0) {
      const Page& page = pages[static_cast<std::size_t>(c)];
      const Pixel p = project(cameras[static_cast<std::size_t>(c)], vec_cast<double>(mesh.positions_m[i]));
      px = {page.at_x - page.x0 + p.u_px + 0.5, page.at_y - page.y0 + p.v_px + 0.5};
    }
    out.mesh.positions_m.push_back(mesh.positions_m[i]);
    out.mesh.normals.push_back(mesh.normals[i]);
    out.uv.push_back({static_cast<float>(px.x * inverse_width), static_cast<float>(px.y * inverse_height)});
    out.photo.push_back(c);
    out.colors.push_back(c >= 0 ? Rgb8{255, 255, 255} : colors[i]);
    return at;
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Index camera = triangle_cameras[t];
    const Index ia = vertex(a, camera), ib = vertex(b, camera), ic = vertex(c, camera);
    out.mesh.triangles.push_back({ia, ib, ic});
  }
  return out;
}

}  // namespace tactus
