#pragma once
/// An OpenGL 4.5 core context without a window. Internal to view/.
#include <memory>
#include <string>

namespace tactus {

class GlContext {
 public:
  /// Tries the GPUs first, then Mesa's surfaceless platform (software). @throws Error with every reason.
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Makes the context the thread's own for as long as this lives, then restores the context that was current
  /// before.
  class Current {
   public:
    explicit Current(const GlContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    void *display_, *context_, *previous_display_, *previous_context_, *previous_draw_, *previous_read_;
  };
  const std::string& description() const { return description_; }
  /// Whether Mesa draws on the CPU.
  bool software() const;

 private:
  void *display_ = nullptr, *context_ = nullptr;
  std::string description_;
};

}  // namespace tactus
