#pragma once
/// FFmpeg's functions, looked up at run time: the libraries bring 90 packages along, which pictures do
/// without.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}
#include <string>

namespace tactus {

/// Pointers under the functions' own names.
struct FilmLibrary {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declared name stands alone
#define TACTUS_FFMPEG(name) decltype(&::name) name = nullptr
  TACTUS_FFMPEG(avformat_open_input);
  TACTUS_FFMPEG(avformat_find_stream_info);
  TACTUS_FFMPEG(avformat_close_input);
  TACTUS_FFMPEG(av_read_frame);
  TACTUS_FFMPEG(av_find_best_stream);
  TACTUS_FFMPEG(av_find_input_format);
  TACTUS_FFMPEG(av_guess_frame_rate);
  TACTUS_FFMPEG(av_stream_get_side_data);
  TACTUS_FFMPEG(avcodec_find_decoder);
  TACTUS_FFMPEG(avcodec_alloc_context3);
  TACTUS_FFMPEG(avcodec_parameters_to_context);
  TACTUS_FFMPEG(avcodec_open2);
  TACTUS_FFMPEG(avcodec_free_context);
  TACTUS_FFMPEG(avcodec_send_packet);
  TACTUS_FFMPEG(avcodec_receive_frame);
  TACTUS_FFMPEG(av_packet_alloc);
  TACTUS_FFMPEG(av_packet_free);
  TACTUS_FFMPEG(av_packet_unref);
  TACTUS_FFMPEG(av_frame_alloc);
  TACTUS_FFMPEG(av_frame_free);
  TACTUS_FFMPEG(av_dict_set);
  TACTUS_FFMPEG(av_dict_free);
  TACTUS_FFMPEG(av_display_rotation_get);
  TACTUS_FFMPEG(av_log_set_level);
  TACTUS_FFMPEG(sws_getCachedContext);
  TACTUS_FFMPEG(sws_scale);
  TACTUS_FFMPEG(sws_freeContext);
#undef TACTUS_FFMPEG
  std::string missing;  ///< "" or the library or function that wasn't found
  FilmLibrary();
  /// Makes the operating system's cameras known. @throws Error without libavdevice.
  static void load_devices();
};

/// Loads the libraries at the first call. @throws Error naming the packages to install.
const FilmLibrary& film_library();

}  // namespace tactus
