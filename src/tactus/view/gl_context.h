#pragma once
/// An OpenGL 4.5 core context without a window. Internal to view/ and xr/.
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
    explicit Current(const GlContext& context) : Current(&context) {}
    /// nullptr: the context that is current stays so.
    explicit Current(const GlContext* context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    void *display_ = nullptr, *context_ = nullptr, *previous_display_ = nullptr, *previous_context_ = nullptr,
         *previous_draw_ = nullptr, *previous_read_ = nullptr;
  };
  const std::string& description() const { return description_; }
  void* display() const { return display_; }  ///< EGLDisplay
  void* context() const { return context_; }  ///< EGLContext

 private:
  void *display_ = nullptr, *context_ = nullptr;
  std::string description_;
};

/// Name and version of the driver whose context is current.
std::string current_context_description();
/// Whether a driver of this description is Mesa's that draws on the CPU.
bool is_software(const std::string& description);

}  // namespace tactus
