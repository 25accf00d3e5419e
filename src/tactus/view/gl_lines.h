#pragma once
/// Straight lines on the GPU. Internal to view/; a context is current wherever they are used.
#include <vector>

#include "tactus/view/gl_mesh.h"
#include "tactus/view/scene.h"

namespace tactus {

/// A line as the shader reads it.
struct LineInstance {
  Vec3f from, to, color;
  float width_px;
};
static_assert(sizeof(LineInstance) == 40);

struct LineSlot {
  GlStreamBuffer buffer;
  GlVertexArray array;
  std::vector<LineInstance> lines;

  LineSlot() {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    array = GlVertexArray(name);
    for (const GLuint i : {0U, 1U, 2U}) {
      glVertexArrayAttribFormat(name, i, i == 2 ? 4 : 3, GL_FLOAT, GL_FALSE, 12 * i);
      glVertexArrayAttribBinding(name, i, 0);
      glEnableVertexArrayAttrib(name, i);
    }
    glVertexArrayBindingDivisor(name, 0, 1);
  }
  void upload(const std::vector<ViewLine>& in) {
    lines.clear();
    for (const ViewLine& l : in) lines.push_back({l.from_m, l.to_m, l.color, l.width_px});
    if (buffer.upload(lines.data(), lines.size() * sizeof(LineInstance)))
      glVertexArrayVertexBuffer(array.get(), 0, buffer.get(), 0, sizeof(LineInstance));
  }
  void draw() const {
    glBindVertexArray(array.get());
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(lines.size()));
  }
};

}  // namespace tactus
