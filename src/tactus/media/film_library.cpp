#ifdef TACTUS_WITH_FFMPEG
#include "tactus/media/film_library.h"

#include <dlfcn.h>

#include "tactus/base/error.h"
#include "tactus/media/film_reader.h"

namespace tactus {
namespace {

/// Stays loaded until the program ends.
void* load(const char* name, int version, std::string& missing) {
  const std::string file = std::string("lib") + name + ".so." + std::to_string(version);
  void* library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr && missing.empty()) missing = file;
  return library;
}

}  // namespace

FilmLibrary::FilmLibrary() {
  void* util = load("avutil", LIBAVUTIL_VERSION_MAJOR, missing);
  void* codec = load("avcodec", LIBAVCODEC_VERSION_MAJOR, missing);
  void* format = load("avformat", LIBAVFORMAT_VERSION_MAJOR, missing);
  void* scale = load("swscale", LIBSWSCALE_VERSION_MAJOR, missing);
  if (!missing.empty()) return;
  const auto find = [this](void* library, const char* name, auto& function) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(library, name));
    if (function == nullptr && missing.empty()) missing = name;
  };
#define TACTUS_FIND(library, name) find(library, #name, name)
  TACTUS_FIND(format, avformat_open_input);
  TACTUS_FIND(format, avformat_find_stream_info);
  TACTUS_FIND(format, avformat_close_input);
  TACTUS_FIND(format, av_read_frame);
  TACTUS_FIND(format, av_find_best_stream);
  TACTUS_FIND(format, av_find_input_format);
  TACTUS_FIND(format, av_guess_frame_rate);
  TACTUS_FIND(format, av_stream_get_side_data);
  TACTUS_FIND(codec, avcodec_find_decoder);
  TACTUS_FIND(codec, avcodec_alloc_context3);
  TACTUS_FIND(codec, avcodec_parameters_to_context);
  TACTUS_FIND(codec, avcodec_open2);
  TACTUS_FIND(codec, avcodec_free_context);
  TACTUS_FIND(codec, avcodec_send_packet);
  TACTUS_FIND(codec, avcodec_receive_frame);
  TACTUS_FIND(codec, av_packet_alloc);
  TACTUS_FIND(codec, av_packet_free);
  TACTUS_FIND(codec, av_packet_unref);
  TACTUS_FIND(util, av_frame_alloc);
  TACTUS_FIND(util, av_frame_free);
  TACTUS_FIND(util, av_dict_set);
  TACTUS_FIND(util, av_dict_free);
  TACTUS_FIND(util, av_display_rotation_get);
  TACTUS_FIND(util, av_log_set_level);
  TACTUS_FIND(scale, sws_getCachedContext);
  TACTUS_FIND(scale, sws_scale);
  TACTUS_FIND(scale, sws_freeContext);
#undef TACTUS_FIND
  // FFmpeg's messages about damaged files would stand beside our own.
  if (missing.empty()) av_log_set_level(AV_LOG_QUIET);
}

void FilmLibrary::load_devices() {
  std::string missing;
  void* device = load("avdevice", LIBAVFORMAT_VERSION_MAJOR, missing);
  auto* all =
      device == nullptr ? nullptr : reinterpret_cast<void (*)()>(::dlsym(device, "avdevice_register_all"));
  if (all == nullptr)
    throw Error("cameras of the system need libavdevice.so." + std::to_string(LIBAVFORMAT_VERSION_MAJOR) +
                " (Debian: libavdevice" + std::to_string(LIBAVFORMAT_VERSION_MAJOR) + "); install it");
  all();
}

const FilmLibrary& film_library() {
  static const FilmLibrary library;
  if (!library.missing.empty()) throw Error("films need " + films_missing() + "; install it");
  return library;
}

std::string films_missing() {
  static const FilmLibrary library;
  if (library.missing.empty()) return "";
  return "FFmpeg's " + library.missing + " (Debian: libavformat" + std::to_string(LIBAVFORMAT_VERSION_MAJOR) +
         ", libswscale" + std::to_string(LIBSWSCALE_VERSION_MAJOR) + "): no films are read";
}

}  // namespace tactus
#endif
