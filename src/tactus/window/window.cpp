#include "tactus/window/window.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/view/image_files.h"
#include "tactus/window/camera_strip.h"
#include "tactus/window/glfw_window.h"
#include "tactus/window/mouse_tools.h"
#include "tactus/window/panels.h"

namespace tactus {
namespace {

/// Panels follow the mouse for so many pictures after the last input.
constexpr int kPicturesAfterInput = 3;
constexpr double kSoon_s = 1.0 / 60, kLater_s = 0.2;

/// Text grows on large screens that don't tell how dense they are.
float text_scale(float content_scale, Vec2i size_px) {
  const float by_size = std::round(4.F * static_cast<float>(size_px.y) / 1080.F) / 4.F;
  return std::max({1.F, content_scale, by_size});
}

class ViewWindow {
 public:
  ViewWindow(LiveRun& run, const WindowOptions& options)
      : run_(run),
        options_(options),
        window_("tactus: " + options.name, options.size_px),
        panels_(window_.get()),
        renderer_(
            {.width_px = options.size_px.x, .height_px = options.size_px.y, .in_current_context = true}),
        mouse_(run.scene(), run.tools(), run.control()),
        shows_panels_(options.shows_panels) {}

  void show() {
    run_.show_cameras(shows_panels_);
    run_.start(GlfwWindow::wake);
    while (!window_.is_closed() && !closes_ && !(options_.should_close && options_.should_close())) {
      const WindowInput input = window_.wait(pictures_due_ > 0 ? kSoon_s : kLater_s, panels_.wants_mouse());
      if (run_.state() == LiveRun::State::failed) run_.rethrow_failure();
      pictures_due_ = input.is_empty ? std::max(0, pictures_due_ - 1) : kPicturesAfterInput;
      take_news();
      follow(input);
      if (!closes_) draw();
    }
    run_.control().stop();  // it ends while the window goes
  }

 private:
  void take_news() {
    if (auto view = run_.take_view()) {
      view_ = std::move(view);
      if (!has_camera_) camera_ = view_->camera();
      has_camera_ = true;
      has_picture_ = false;
      history_.clear();
      past_.reset();
      strip_.clear();
      mouse_.release();
    }
    if (auto frame = run_.take_frame(); frame && view_) {
      history_.add(frame);
      if (!past_) show_frame(*frame);
      take_cameras(*frame);
    }
  }

  /// Photographs come with the frame, so images of another one would lie on the wrong ones.
  void take_cameras(const ViewedFrame& frame) {
    const auto look = run_.take_cameras();
    if (look && (frame.photos.empty() || look->number == frame.number)) strip_.take(look, frame.photos);
  }

  void show_frame(const ViewedFrame& frame) {
    view_->show(*frame.snapshot, frame.photos);
    is_drawn_ = false;
    has_picture_ = true;
    pictures_due_ = std::max(pictures_due_, 1);  // panels take the size of their text a picture later
  }

  const ViewedFrame* shown() const { return past_ ? past_.get() : history_.newest(); }

  /// Pauses, and shows a frame that was seen; the newest is no past.
  void show_past(const SeenFrame& seen) {
    if (!seen.frame || !has_picture_) return;
    if (run_.state() == LiveRun::State::running) run_.control().set_paused(true);
    past_ = seen.frame->number < history_.newest()->number ? seen.frame : nullptr;
    show_frame(*shown());
  }

  void leave_past() {
    if (!past_) return;
    past_.reset();
    show_frame(*history_.newest());
  }

  void scrub(const WindowInput& input) {
    if (!has_picture_) return;
    const SeenFrames& past = run_.past();
    if (input.past_steps != 0) show_past(past.moved(shown()->number, input.past_steps));
    if (input.pressed_home) show_past(past.nearest(past.range().first));
    if (input.pressed_end) leave_past();
  }

  /// From the frame that is shown, or from the one that is kept.
  void simulate_again() { run_.simulate_again(past_ ? run_.past().state_at(past_->number) : run_.kept()); }

  void follow(const WindowInput& input) {
    const Vec2i size = window_.framebuffer_px();
    const auto height = static_cast<float>(std::max(size.y, 1));
    const bool moves = input.orbited_px.x != 0 || input.orbited_px.y != 0 || input.panned_px.x != 0 ||
                       input.panned_px.y != 0 || input.wheel != 0;
    if (moves) {
      orbit(camera_, input.orbited_px, height);
      pan(camera_, input.panned_px, height);
      zoom(camera_, input.wheel);
      is_drawn_ = false;
    }
    if (input.pressed_tab) shows_panels_ = !shows_panels_;
    if (!panels_.wants_text()) {
      for (const unsigned code : input.typed) type(code);
      scrub(input);
    }
    if (const ViewedFrame* frame = history_.newest(); frame != nullptr && !past_)
      mouse_.follow(input, *frame, camera_, {static_cast<float>(size.x), static_cast<float>(size.y)});
  }

  void type(unsigned code) {
    if (code == ' ' || code == '.') leave_past();
    if (code == ' ') run_.control().toggle_pause();
    if (code == '.') run_.control().step();
    if (code == 'r') run_.control().restart();
    if (code == 'k') past_ ? run_.keep(run_.past().state_at(past_->number)) : run_.control().keep();
    if (code == 'b') simulate_again();
    if (code == 't') mouse_.take_next_tool();
    if (code == 'h') shows_help_ = !shows_help_;
    if (code == 'c') shows_contacts_ = !shows_contacts_;
    if (code == 'i') shows_cameras_ = !shows_cameras_;
    if (code == 'q') closes_ = true;
    if (code == 's' && has_picture_) save_picture();
    if (code == 'v' && view_) {
      camera_ = view_->camera();
      is_drawn_ = false;
    }
  }

  /// Drawn anew, as a film's, in a context of its own: a thread has one at a time.
  void save_picture() {
    const Vec2i size = window_.framebuffer_px();
    const std::string path = options_.name + "-" + std::to_string(shown()->number) + ".png";
    std::string error;
    std::thread([&] {
      try {
        Renderer renderer({.width_px = size.x, .height_px = size.y});
        write_png(path, renderer.render(view_->scene(), camera_));
      } catch (const Error& e) {
        error = e.what();
      }
    }).join();
    if (!error.empty())
      log_warning(error);
    else
      log_info("wrote " + path);
  }

  void draw() {
    const Vec2i size = window_.framebuffer_px();
    if (size.x < 16 || size.y < 16) return;  // it is minimised
    if (size.x != drawn_px_.x || size.y != drawn_px_.y) {
      renderer_.resize(std::min(size.x, 8192), std::min(size.y, 8192));
      drawn_px_ = size;
      is_drawn_ = false;
    }
    if (has_picture_ && is_drawn_)
      renderer_.draw_again();
    else if (has_picture_)
      renderer_.draw(view_->scene(), camera_);
    else
      renderer_.draw(ViewScene{.ground = false}, ViewCamera{});
    is_drawn_ = has_picture_;
    draw_panels(size);
    window_.show_picture();
  }

  ShownPast shown_past() const {
    ShownPast shown{run_.past().range(), past_, 0, run_.why_not_again()};
    if (!past_) return shown;
    const auto state = run_.past().state_at(past_->number);
    shown.again_from = state ? state->number : 0;
    return shown;
  }

  void draw_panels(Vec2i size) {
    RunControl& control = run_.control();
    const bool is_paused = control.is_paused();
    const bool can_scrub = is_paused || run_.state() == LiveRun::State::ended;
    if (past_ && !can_scrub) leave_past();
    const auto kept = run_.kept();
    const PanelModel model =
        panel_model(options_.name, history_, run_.state(), is_paused, control.pending_parameters(),
                    kept ? kept->number : 0, mouse_.tool(), can_scrub ? shown_past() : ShownPast{});
    window_.set_title(model.title);
    panels_.begin(text_scale(window_.content_scale(), size));
    if (has_picture_) {
      panels_.draw_labels(renderer_.labels());
      if (shows_contacts_) panels_.draw_arrows(shown()->contacts, camera_, 0.12F * camera_.distance_m);
      if (const auto spring = past_ ? std::nullopt : mouse_.spring(*history_.newest()))
        panels_.draw_spring(spring->from_m, spring->to_m, camera_);
    } else {
      panels_.draw_message(model.state);
    }
    if (shows_panels_) {
      const PanelRequests requests = panels_.draw(model, is_paused);
      if (requests.toggle_pause || requests.step) leave_past();
      if (requests.past_frame > 0) show_past(run_.past().nearest(requests.past_frame));
      if (requests.again) simulate_again();
      if (requests.toggle_pause) control.toggle_pause();
      if (requests.step) control.step();
      if (requests.restart) control.restart();
      if (!requests.parameter.empty()) control.set_parameter(requests.parameter, requests.value);
    }
    draw_cameras();
    if (shows_help_) panels_.draw_help({run_.tools().size(), !run_.scene().bodies.empty()});
    panels_.end();
  }

  void draw_cameras() {
    const bool shows = shows_panels_ && shows_cameras_;
    run_.show_cameras(shows);
    if (!shows || strip_.is_empty()) return;
    const CameraModel model = strip_.model(run_.checkup());
    if (has_picture_ && run_.scene().view.show_frusta)
      CameraStrip::draw_faults(model, camera_, panels_.scale());
    strip_.draw(model, panels_.scale());
  }

  LiveRun& run_;
  const WindowOptions& options_;
  GlfwWindow window_;
  Panels panels_;
  CameraStrip strip_;
  Renderer renderer_;
  std::unique_ptr<SceneView> view_;
  RunHistory history_;
  std::shared_ptr<const ViewedFrame> past_;  ///< that is shown instead of the newest
  MouseTools mouse_;
  ViewCamera camera_;
  Vec2i drawn_px_{};
  bool shows_panels_, shows_help_ = false, shows_contacts_ = true, shows_cameras_ = true, closes_ = false;
  bool has_camera_ = false, has_picture_ = false;
  bool is_drawn_ = false;  ///< the renderer's picture is of this frame and camera
  int pictures_due_ = 0;
};

}  // namespace

std::string window_missing() { return ""; }

bool show_window(Scene scene, LiveRun::Options run_options, const WindowOptions& options) {
  // A window is gone as soon as it is closed, even where a frame takes long.
  constexpr double kMostWait_s = 0.25;
  auto run = std::make_unique<LiveRun>(std::move(scene), std::move(run_options));
  run->control().set_paused(options.is_paused);
  ViewWindow(*run, options).show();
  if (run->stop(kMostWait_s)) return true;
  static_cast<void>(run.release());  // its thread still works
  return false;
}

}  // namespace tactus
