#include "tactus/view/renderer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/view/edge_smoothing.h"
#include "tactus/view/gl_context.h"
#include "tactus/view/gl_light.h"
#include "tactus/view/gl_lines.h"
#include "tactus/view/gl_liquid.h"
#include "tactus/view/gl_mesh.h"
#include "tactus/view/gl_objects.h"
#include "tactus/view/gl_photos.h"
#include "tactus/view/gl_uniforms.h"
#include "tactus/view/image_files.h"
#include "tactus/view/picture_layout.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

/// A line on a surface is drawn as if it were nearer by this share.
constexpr float kLineNearer = 2e-3F;

float to_linear(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}
Vec3f to_linear(Vec3f c) { return {to_linear(c.x), to_linear(c.y), to_linear(c.z)}; }

const RendererOptions& checked(const RendererOptions& o) {
  const auto in_range = [](const char* name, Index value, Index low, Index high) {
    if (value < low || value > high) {
      throw Error(std::string("renderer: ") + name + " is " + std::to_string(value) + ", expected " +
                  std::to_string(low) + " to " + std::to_string(high));
    }
  };
  in_range("width_px", o.width_px, 16, 8192);
  in_range("height_px", o.height_px, 16, 8192);
  if (o.shadow_map_px != 0) in_range("shadow_map_px", o.shadow_map_px, 64, 8192);
  if (o.samples != 0 && o.samples != 1 && o.samples != 2 && o.samples != 4 && o.samples != 8)
    throw Error("renderer: samples is " + std::to_string(o.samples) + ", expected 0, 1, 2, 4 or 8");
  return o;
}

Rgb8 to_rgb8(Vec3f c) {
  const auto byte = [](float x) { return static_cast<std::uint8_t>(clamp(255 * x + 0.5F, 0.F, 255.F)); };
  return {byte(c.x), byte(c.y), byte(c.z)};
}

/// Two channels of noise that repeats, for fibres.
GlTexture make_grain() {
  constexpr GLsizei kSide = 32;
  std::vector<std::uint8_t> noise(std::size_t{2} * kSide * kSide * kSide);
  std::uint32_t random = 1;
  for (std::uint8_t& n : noise) {
    random = random * 1664525U + 1013904223U;
    n = static_cast<std::uint8_t>(random >> 24U);
  }
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_3D, 1, &name);
  glTextureStorage3D(name, 1, GL_RG8, kSide, kSide, kSide);
  glTextureSubImage3D(name, 0, 0, 0, 0, kSide, kSide, kSide, GL_RG, GL_UNSIGNED_BYTE, noise.data());
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  return GlTexture(name);
}

GLuint drawn_framebuffer() {
  GLint name = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &name);
  return static_cast<GLuint>(name);
}

}  // namespace

struct Renderer::Impl {
  explicit Impl(const RendererOptions& o) : options(checked(o)) {
    if (!options.in_current_context) own_context = std::make_unique<GlContext>();
    const Entered current = enter();
    description = own_context ? own_context->description() : current_context_description();
    smooth = options.samples == 0 && is_software(description);
    if (options.samples == 0) options.samples = smooth ? 1 : 4;
    gl = std::make_unique<Objects>(options);
  }
  ~Impl() {
    try {
      const Entered current = enter();
      gl.reset();
    } catch (const Error& error) {
      log_warning(error.what());
      static_cast<void>(gl.release());  // freed with the context: without it no call of OpenGL is possible
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Holds the renderer's own context, or nothing where the caller's is used.
  using Entered = GlContext::Current;
  Entered enter() const { return Entered(own_context.get()); }

  struct Objects {
    explicit Objects(const RendererOptions& o)
        : picture(o.width_px, o.height_px, o.samples), light(o.shadow_map_px, o.ambient_occlusion) {
      GLuint name = 0;
      glCreateVertexArrays(1, &name);
      no_attributes = GlVertexArray(name);
    }
    GlProgram surface{"surface", {shaders::kSurfaceVertex}, {shaders::kLight, shaders::kSurfaceFragment}};
    GlProgram tissue{"tissue",
                     {shaders::kTissue, shaders::kSurfaceVertex},
                     {shaders::kTissue, shaders::kLight, shaders::kSurfaceFragment}};
    GlProgram ground{"ground", {shaders::kGroundVertex}, {shaders::kLight, shaders::kGroundFragment}};
    GlProgram background{
        "background", {shaders::kBackgroundVertex}, {shaders::kLight, shaders::kBackgroundFragment}};
    GlProgram line{"line", {shaders::kLineVertex}, {shaders::kLineFragment}};
    GlProgram wire{"wire", {shaders::kSurfaceVertex}, {shaders::kWireFragment}};
    GlPictureTarget picture;
    GlLight light;
    GlVertexArray no_attributes;
    GlTexture grain = make_grain();
    std::vector<GlMesh> meshes;
    std::unique_ptr<GlPhotoPrograms> photo_programs;  ///< made when the first photos come
    std::vector<std::unique_ptr<GlPhotos>> photos;    ///< of the meshes that wear some
    LineSlot lines, box_edges;
    std::unique_ptr<GlLiquid> liquid;  ///< made when the first one comes
    GlShownImage shown;
  };

  void resize(Index width_px, Index height_px) {
    if (width_px == options.width_px && height_px == options.height_px) return;
    RendererOptions resized = options;
    resized.width_px = width_px;
    resized.height_px = height_px;
    options = checked(resized);
    const Entered current = enter();
    gl->picture = GlPictureTarget(width_px, height_px, options.samples);
    gl->liquid.reset();
  }

  void upload(const ViewScene& scene) {
    while (gl->meshes.size() < scene.meshes.size()) gl->meshes.emplace_back();
    gl->photos.resize(gl->meshes.size());
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
      gl->meshes[i].upload(scene.meshes[i]);
      if (!scene.meshes[i].photos) continue;
      if (!gl->photo_programs) gl->photo_programs = std::make_unique<GlPhotoPrograms>();
      if (!gl->photos[i]) gl->photos[i] = std::make_unique<GlPhotos>();
      gl->photos[i]->upload(scene.meshes[i]);
      gl->photos[i]->draw_maps(*gl->photo_programs, gl->meshes[i], gl->no_attributes);
    }
    gl->lines.upload(scene.lines);
  }

  void upload_edges(const ViewScene& scene, Vec3f eye_m) {
    box_edges.clear();
    for (const ViewBox& box : scene.boxes) add_far_edges(box_edges, box, eye_m);
    gl->box_edges.upload(box_edges);
  }

  void draw_light(const ViewScene& scene, const PictureLayout& l) {
    casters.clear();
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
      if (scene.meshes[i].casts_shadow) casters.push_back(&gl->meshes[i]);
    gl->light.draw(casters, l);
  }

  void set_light(const GlProgram& program, const PictureLayout& l) {
    set(program, "view_proj", l.view_proj);
    set(program, "eye", l.eye_m);
    gl->light.set_uniforms(program, l);
    set(program, "picture_px", static_cast<float>(options.width_px), static_cast<float>(options.height_px));
  }

  /// The program that draws a mesh, told all about it.
  const GlProgram& prepare(const ViewMesh& view, std::size_t i) {
    const Material& m = view.material;
    if (view.photos) {
      gl->photos[i]->bind(*gl->photo_programs);
      set(gl->photo_programs->surface, "opacity", clamp(m.opacity, 0.F, 1.F));
      return gl->photo_programs->surface;
    }
    const GlProgram& program = view.film || view.flesh ? gl->tissue : gl->surface;
    set(program, "dry_albedo", to_linear(m.color));
    set(program, "dry_roughness", clamp(m.roughness, 0.05F, 1.F));
    set(program, "dry_specular", clamp(m.specular, 0.F, 1.F));
    set(program, "softness", clamp(m.softness, 0.F, 1.F));
    set(program, "opacity", clamp(m.opacity, 0.F, 1.F));
    set(program, "is_photographed", !view.colors.empty());
    set(program, "flat_shaded", view.device ? view.device->normals.empty() : view.mesh.normals.empty());
    if (view.film) {
      set(program, "film_scattered", view.film->scattered);
      set(program, "film_absorption_1_m", view.film->absorption_1_m);
    }
    set(program, "grain_m", view.flesh ? view.flesh->grain_m : 1);
    set(program, "lip_m", view.flesh ? view.flesh->lip_m : 1);
    return program;
  }

  void draw_surface(const ViewMesh& view, std::size_t i) {
    const Material& m = view.material;
    const GlMesh& slot = gl->meshes[i];
    const GlProgram& program = prepare(view, i);
    glUseProgram(program.get());
    (m.two_sided ? glDisable : glEnable)(GL_CULL_FACE);
    slot.draw(program);
    if (m.wireframe > 0) {
      glUseProgram(gl->wire.get());
      set(gl->wire, "strength", clamp(m.wireframe, 0.F, 1.F));
      glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
      glEnable(GL_POLYGON_OFFSET_LINE);
      glPolygonOffset(-1, -1);
      glEnable(GL_BLEND);
      slot.draw(gl->wire);
      glDisable(GL_BLEND);
      glDisable(GL_POLYGON_OFFSET_LINE);
      glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    }
    glDisable(GL_CULL_FACE);
  }

  /// Depth first, so that only the layer nearest to the eye is blended.
  void draw_translucent(const ViewMesh& view, std::size_t i) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw_surface(view, i);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    draw_surface(view, i);
    glDisable(GL_BLEND);
  }

  void draw_picture(const ViewScene& scene, const PictureLayout& l) {
    glBindFramebuffer(GL_FRAMEBUFFER, gl->picture.framebuffer.get());
    glViewport(0, 0, options.width_px, options.height_px);
    const Vec3f plain = scene.background.value_or(Vec3f{});
    glClearColor(plain.x, plain.y, plain.z, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl->light.bind();
    glBindTextureUnit(8, gl->grain.get());
    for (const GlProgram* p : {&gl->surface, &gl->tissue, &gl->ground, &gl->background, &gl->wire, &gl->line})
      set_light(*p, l);
    if (gl->photo_programs) set_light(gl->photo_programs->surface, l);
    draw_room(scene, l);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
      if (scene.meshes[i].material.opacity >= 1) draw_surface(scene.meshes[i], i);
    }
    draw_lines(gl->lines, l);
    for (const ViewLiquid& liquid : scene.liquids) draw_liquid(liquid, scene, l);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
      if (scene.meshes[i].material.opacity < 1) draw_translucent(scene.meshes[i], i);
    }
  }

  /// The background of all else. Edges of boxes leave no depth: they cross nothing, though a body reach out
  /// of its box.
  void draw_room(const ViewScene& scene, const PictureLayout& l) {
    glBindVertexArray(gl->no_attributes.get());
    if (l.has_ground) {
      glUseProgram(gl->ground.get());
      set(gl->ground, "ground_center", l.ground_center);
      set(gl->ground, "ground_radius_m", l.ground_radius_m);
      set(gl->ground, "tile_m", max(scene.ground_tile_m, 1e-4F));
      glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
    if (!scene.background) {
      glUseProgram(gl->background.get());
      glDrawArrays(GL_TRIANGLES, 0, 3);
    }
    glDepthMask(GL_FALSE);
    draw_lines(gl->box_edges, l);
    glDepthMask(GL_TRUE);
  }

  void draw_lines(const LineSlot& slot, const PictureLayout& l) {
    if (slot.lines.empty()) return;
    set(gl->line, "near_m", l.near_m);
    set(gl->line, "nearer", kLineNearer * l.eye.clip_eye(2, 3));
    glUseProgram(gl->line.get());
    glEnable(GL_BLEND);
    slot.draw();
    glDisable(GL_BLEND);
  }

  void draw_liquid(const ViewLiquid& liquid, const ViewScene& scene, const PictureLayout& l) {
    if (liquid.positions_m.empty()) return;
    if (!gl->liquid) gl->liquid = std::make_unique<GlLiquid>(options.width_px, options.height_px);
    gl->liquid->draw_maps(liquid, liquid_balls(liquid, scene), l.eye, gl->picture.framebuffer.get());
    glBindFramebuffer(GL_FRAMEBUFFER, gl->picture.framebuffer.get());
    set_light(gl->liquid->surface(), l);
    gl->liquid->draw(liquid, l.eye);
  }

  /// Distance along the view of the surface at a pixel of the picture [m]; `y` counts from above.
  float depth_m_at(Index x, Index y) {
    const Index row = options.height_px - 1 - y;
    glBlitNamedFramebuffer(gl->picture.framebuffer.get(), gl->picture.resolved.get(), x, row, x + 1, row + 1,
                           x, row, x + 1, row + 1, GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gl->picture.resolved.get());
    float depth = 1;
    glReadPixels(x, row, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
    return clip_eye(2, 3) / (2 * depth - 1 + clip_eye(2, 2));
  }

  /// Labels whose place is seen.
  void find_labels(const ViewScene& scene, const ViewCamera& camera, const PictureLayout& l) {
    const Rigidf T = camera.T_cam_world();
    for (const ViewLabel& label : scene.labels) {
      const Vec3f p = T * label.at_m;
      if (!(-p.z > l.near_m)) continue;
      const Vec3f ndc{p.x / (-p.z * l.eye.tangent_x), p.y / (-p.z * l.eye.tangent_y), 0};
      const auto x = static_cast<Index>((0.5F + 0.5F * ndc.x) * static_cast<float>(options.width_px));
      const auto y = static_cast<Index>((0.5F - 0.5F * ndc.y) * static_cast<float>(options.height_px));
      if (!(std::abs(ndc.x) < 1 && std::abs(ndc.y) < 1)) continue;
      if (depth_m_at(std::min(x, options.width_px - 1), std::min(y, options.height_px - 1)) < -0.99F * p.z)
        continue;
      labels.push_back({label.text, x - text_width_px(label.text, label.height_px) / 2, y - 5,
                        label.height_px, label.color});
    }
  }

  std::vector<float> depths_m() {
    const Entered current = enter();
    const Index w = options.width_px, h = options.height_px;
    glBlitNamedFramebuffer(gl->picture.framebuffer.get(), gl->picture.resolved.get(), 0, 0, w, h, 0, 0, w, h,
                           GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gl->picture.resolved.get());
    std::vector<float> rows(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)), depths(rows.size());
    glReadPixels(0, 0, w, h, GL_DEPTH_COMPONENT, GL_FLOAT, rows.data());
    for (Index y = 0; y < h; ++y) {
      for (Index x = 0; x < w; ++x) {
        const float ndc = 2 * rows[static_cast<std::size_t>((h - 1 - y) * w + x)] - 1;
        depths[static_cast<std::size_t>(y * w + x)] = clip_eye(2, 3) / (ndc + clip_eye(2, 2));
      }
    }
    return depths;
  }

  /// The picture's samples become pixels.
  void resolve() {
    const Index w = options.width_px, h = options.height_px;
    glBlitNamedFramebuffer(gl->picture.framebuffer.get(), gl->picture.resolved.get(), 0, 0, w, h, 0, 0, w, h,
                           GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }

  /// Draws all but labels, and finds these; for an eye, there are none.
  void paint(const ViewScene& scene, const ViewCamera& camera, const ViewEye* eye = nullptr,
             bool is_same = false) {
    if (!is_same)
      for (const ViewMesh& view : scene.meshes) check_mesh(view);
    const float aspect = static_cast<float>(options.width_px) / static_cast<float>(options.height_px);
    const PictureLayout layout = lay_out(scene, camera, aspect, eye);
    if (!is_same) upload(scene);
    upload_edges(scene, layout.eye_m);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    if (!is_same) draw_light(scene, layout);
    draw_picture(scene, layout);
    clip_eye = layout.eye.clip_eye;
    resolve();
    labels.clear();
    if (eye == nullptr) find_labels(scene, camera, layout);
  }

  /// Into the caller's framebuffer.
  void show(GLuint framebuffer) {
    const Index w = options.width_px, h = options.height_px;
    // An image's rows go down, OpenGL's go up.
    glBlitNamedFramebuffer(smooth ? gl->shown.framebuffer() : gl->picture.resolved.get(), framebuffer, 0, 0,
                           w, h, 0, smooth ? h : 0, w, smooth ? 0 : h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  }

  void smooth_and_show(GLuint framebuffer) {
    if (smooth) {
      read_back(jagged);
      smooth_edges(jagged, smoothed);
      gl->shown.upload(smoothed);
    }
    show(framebuffer);
  }

  void read_back(ColorImage& image) {
    const Index w = options.width_px, h = options.height_px;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gl->picture.resolved.get());
    rgba.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 4);
    glReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
    image.width_px = w;
    image.height_px = h;
    image.pixels.resize(rgba.size() / 4);
    for (Index y = 0; y < h; ++y) {  // OpenGL's rows go up
      const std::uint8_t* from =
          rgba.data() + static_cast<std::size_t>(h - 1 - y) * static_cast<std::size_t>(w) * 4;
      Rgb8* to = &image(0, y);
      for (Index x = 0; x < w; ++x, from += 4) to[x] = {from[0], from[1], from[2]};
    }
  }

  RendererOptions options;
  std::unique_ptr<GlContext> own_context;  ///< none: the caller's is current
  std::string description;
  std::unique_ptr<Objects> gl;
  std::vector<PlacedLabel> labels;
  std::vector<const GlMesh*> casters;
  std::vector<ViewLine> box_edges;
  std::vector<std::uint8_t> rgba;
  bool smooth = false;  ///< edges, after drawing
  ColorImage jagged, smoothed;
  Mat4 clip_eye;  ///< of the last picture
};

Renderer::Renderer(const RendererOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

ColorImage Renderer::render(const ViewScene& scene, const ViewCamera& camera) {
  ColorImage image;
  render(scene, camera, image);
  return image;
}

void Renderer::render(const ViewScene& scene, const ViewCamera& camera, ColorImage& image) {
  Impl& impl = *impl_;
  const Impl::Entered current = impl.enter();
  impl.paint(scene, camera);
  impl.read_back(impl.smooth ? impl.jagged : image);
  if (impl.smooth) smooth_edges(impl.jagged, image);
  for (const PlacedLabel& label : impl.labels)
    draw_text(image, label.text, label.x_px, label.y_px, label.height_px, to_rgb8(label.color));
}

void Renderer::draw(const ViewScene& scene, const ViewCamera& camera) {
  const Impl::Entered current = impl_->enter();
  const GLuint framebuffer = drawn_framebuffer();
  impl_->paint(scene, camera);
  impl_->smooth_and_show(framebuffer);
}

void Renderer::draw_eye(const ViewScene& scene, const ViewCamera& camera, const ViewEye& eye, bool is_same) {
  const Impl::Entered current = impl_->enter();
  const GLuint framebuffer = drawn_framebuffer();
  impl_->paint(scene, camera, &eye, is_same);
  impl_->smooth_and_show(framebuffer);
}

void Renderer::copy_depth() {
  const Impl::Entered current = impl_->enter();
  const Index w = impl_->options.width_px, h = impl_->options.height_px;
  glBlitNamedFramebuffer(impl_->gl->picture.framebuffer.get(), drawn_framebuffer(), 0, 0, w, h, 0, 0, w, h,
                         GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

void Renderer::draw_again() {
  const Impl::Entered current = impl_->enter();
  impl_->show(drawn_framebuffer());
}

const std::vector<PlacedLabel>& Renderer::labels() const { return impl_->labels; }

void Renderer::resize(Index width_px, Index height_px) { impl_->resize(width_px, height_px); }

float Renderer::depth_m(Index x_px, Index y_px) {
  const Impl::Entered current = impl_->enter();
  return impl_->depth_m_at(x_px, y_px);
}

std::vector<float> Renderer::depths_m() { return impl_->depths_m(); }

const std::string& Renderer::description() const { return impl_->description; }

std::string Renderer::sharing(const Device& device) {
  const GlContext context;
  const GlContext::Current current(context);
  return gl_sharing(device).text;
}

std::string Renderer::why_unavailable() {
  try {
    const GlContext context;
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace tactus
