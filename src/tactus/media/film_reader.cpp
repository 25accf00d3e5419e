#include "tactus/media/film_reader.h"

#include "tactus/base/error.h"

#ifdef TACTUS_WITH_FFMPEG
#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>

#include "tactus/media/film_library.h"
#include "tactus/media/picture.h"

namespace tactus {
namespace {

constexpr int kMostBadPackets = 4096;

}  // namespace

struct FilmReader::State {
  const FilmLibrary& av = film_library();
  AVFormatContext* file = nullptr;
  AVCodecContext* decoder = nullptr;
  SwsContext* converter = nullptr;
  AVPacket* packet = nullptr;
  AVFrame* decoded = nullptr;
  AVStream* stream = nullptr;
  int orientation = 1;  ///< as of EXIF
  bool drained = false;
  std::optional<double> first_s;
  double now_s = 0;
  std::int64_t frames = 0;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    av.sws_freeContext(converter);
    av.av_frame_free(&decoded);
    av.av_packet_free(&packet);
    av.avcodec_free_context(&decoder);
    av.avformat_close_input(&file);
  }

  void open(const std::string& what, const AVInputFormat* format, AVDictionary* options) {
    const int failed =
        av.avformat_open_input(&file, what.c_str(), const_cast<AVInputFormat*>(format), &options);
    av.av_dict_free(&options);
    if (failed < 0) throw Error("cut short, or another format");
    if (av.avformat_find_stream_info(file, nullptr) < 0) throw Error("no stream in it can be read");
    const int index = av.av_find_best_stream(file, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    if (index < 0) throw Error("there are no pictures in it");
    stream = file->streams[index];
    const AVCodec* codec = av.avcodec_find_decoder(stream->codecpar->codec_id);
    decoder = codec == nullptr ? nullptr : av.avcodec_alloc_context3(codec);
    if (decoder == nullptr) throw Error("FFmpeg can't decode it here");
    av.avcodec_parameters_to_context(decoder, stream->codecpar);
    decoder->pkt_timebase = stream->time_base;
    decoder->thread_count = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
    if (static_cast<std::uint64_t>(std::max(decoder->width, 0)) *
            static_cast<std::uint64_t>(std::max(decoder->height, 0)) >
        kMaxPicturePixels)
      throw Error("it has more than 256 megapixels");
    decoder->max_pixels = static_cast<std::int64_t>(kMaxPicturePixels);
    if (av.avcodec_open2(decoder, codec, nullptr) < 0) throw Error("FFmpeg can't decode it here");
    packet = av.av_packet_alloc();
    decoded = av.av_frame_alloc();
    if (packet == nullptr || decoded == nullptr) throw Error("no memory is left for it");
    find_orientation();
  }

  void find_orientation() {
    const auto* matrix = reinterpret_cast<const std::int32_t*>(
        av.av_stream_get_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr));
    if (matrix == nullptr) return;
    const double turn = av.av_display_rotation_get(matrix);  // counterclockwise
    if (std::isnan(turn)) return;
    constexpr int kOfQuarters[] = {1, 8, 3, 6};
    orientation = kOfQuarters[static_cast<std::size_t>((std::lround(turn / 90) % 4 + 4) % 4)];
  }

  /// The next frame, not yet a picture.
  bool decode() {
    for (int bad = 0; bad < kMostBadPackets;) {
      const int got = av.avcodec_receive_frame(decoder, decoded);
      if (got == 0) return stamp();
      if (got == AVERROR_EOF || (got != AVERROR(EAGAIN) && drained)) return false;
      if (got != AVERROR(EAGAIN)) ++bad;
      if (drained) return false;
      const int read = av.av_read_frame(file, packet);
      if (read == AVERROR(EAGAIN)) continue;
      if (read < 0) {
        drained = true;
        av.avcodec_send_packet(decoder, nullptr);
        continue;
      }
      if (packet->stream_index == stream->index && av.avcodec_send_packet(decoder, packet) < 0) ++bad;
      av.av_packet_unref(packet);
    }
    return false;
  }

  /// Frames without a stamp follow the one before at the mean rate.
  bool stamp() {
    const double rate = fps();
    if (decoded->best_effort_timestamp != AV_NOPTS_VALUE) {
      const double stamp_s = static_cast<double>(decoded->best_effort_timestamp) * av_q2d(stream->time_base);
      if (!first_s) first_s = stamp_s;
      now_s = stamp_s - *first_s;
    } else if (frames > 0) {
      now_s += rate > 0 ? 1 / rate : 1.0 / 30;
    }
    ++frames;
    return true;
  }

  double fps() const {
    // The guess may be the rate of the coding, which a film of variable rate never has.
    const AVRational mean = stream->avg_frame_rate;
    const AVRational rate =
        mean.num > 0 && mean.den > 0 ? mean : av.av_guess_frame_rate(file, stream, nullptr);
    const double fps = rate.den == 0 ? 0 : av_q2d(rate);
    return std::isfinite(fps) && fps > 0 ? fps : 0;
  }

  bool picture(FilmFrame& frame) {
    const int width = decoded->width, height = decoded->height;
    converter =
        av.sws_getCachedContext(converter, width, height, static_cast<AVPixelFormat>(decoded->format), width,
                                height, AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr);
    if (converter == nullptr) return false;
    // The converter writes rows of whole vectors, so rows have room behind them.
    constexpr std::size_t kRowEnd = 64;
    const std::size_t row = 3 * static_cast<std::size_t>(width);
    const std::size_t stride = (row + kRowEnd - 1) / kRowEnd * kRowEnd;
    rows.resize(stride * static_cast<std::size_t>(height) + kRowEnd);
    std::uint8_t* to[] = {rows.data(), nullptr, nullptr, nullptr};
    const int strides[] = {static_cast<int>(stride), 0, 0, 0};
    if (av.sws_scale(converter, decoded->data, decoded->linesize, 0, height, to, strides) != height)
      return false;
    frame.bgr.resize(row * static_cast<std::size_t>(height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
      std::copy_n(rows.data() + y * stride, row, frame.bgr.data() + y * row);
    frame.width_px = width;
    frame.height_px = height;
    frame.time_s = now_s;
    if (orientation == 1) return true;
    Picture turned{width, height, 3, 8, std::move(frame.bgr)};
    make_upright(turned, orientation);
    frame.width_px = turned.width_px;
    frame.height_px = turned.height_px;
    frame.bgr = std::move(turned.bytes);
    return true;
  }
  std::vector<std::uint8_t> rows;
};

FilmReader::FilmReader(const std::string& file) : state_(std::make_unique<State>()) {
  AVDictionary* options = nullptr;
  // A film may name others to be read; none of them.
  state_->av.av_dict_set(&options, "protocol_whitelist", "file", 0);
  state_->open("file:" + file, nullptr, options);
}
FilmReader::FilmReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
FilmReader::~FilmReader() = default;
FilmReader::FilmReader(FilmReader&&) noexcept = default;
FilmReader& FilmReader::operator=(FilmReader&&) noexcept = default;

FilmReader FilmReader::stream(const std::string& url) {
  auto state = std::make_unique<State>();
  state->open(url, nullptr, nullptr);
  return FilmReader(std::move(state));
}

FilmReader FilmReader::device(const std::string& path, const Device& wanted) {
  auto state = std::make_unique<State>();
  FilmLibrary::load_devices();
  AVDictionary* options = nullptr;
  if (wanted.width_px > 0 && wanted.height_px > 0) {
    const std::string size = std::to_string(wanted.width_px) + "x" + std::to_string(wanted.height_px);
    state->av.av_dict_set(&options, "video_size", size.c_str(), 0);
  }
  state->av.av_dict_set(&options, "framerate", std::to_string(wanted.fps).c_str(), 0);
  const AVInputFormat* format = state->av.av_find_input_format("video4linux2");
  if (format == nullptr) throw Error("FFmpeg has no Video4Linux here");
  state->open(path, format, options);
  return FilmReader(std::move(state));
}

int FilmReader::width_px() const {
  return state_->orientation >= 5 ? state_->decoder->height : state_->decoder->width;
}
int FilmReader::height_px() const {
  return state_->orientation >= 5 ? state_->decoder->width : state_->decoder->height;
}
double FilmReader::fps() const { return state_->fps(); }

int FilmReader::frame_count() const {
  if (state_->stream->nb_frames > 0)
    return static_cast<int>(std::min<std::int64_t>(state_->stream->nb_frames, 1 << 30));
  const AVStream& s = *state_->stream;
  double length_s = 0;
  if (s.duration > 0 && s.duration != AV_NOPTS_VALUE)
    length_s = static_cast<double>(s.duration) * av_q2d(s.time_base);
  else if (state_->file->duration > 0)
    length_s = static_cast<double>(state_->file->duration) / AV_TIME_BASE;
  return static_cast<int>(std::min(std::floor(length_s * fps() + 0.5), 1e9));
}

bool FilmReader::read(FilmFrame& frame) { return state_->decode() && state_->picture(frame); }
bool FilmReader::skip() { return state_->decode(); }
bool FilmReader::picture(FilmFrame& frame) { return state_->frames > 0 && state_->picture(frame); }
double FilmReader::time_s() const { return state_->now_s; }

}  // namespace tactus

#else  // without FFmpeg

namespace tactus {

struct FilmReader::State {};

std::string films_missing() { return "FFmpeg (tools/install_deps.sh films): no films are read"; }
namespace {
[[noreturn]] void refuse() { throw Error("films need " + films_missing() + "; install it and build again"); }
}  // namespace
FilmReader::FilmReader(const std::string&) { refuse(); }
FilmReader::FilmReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
FilmReader::~FilmReader() = default;
FilmReader::FilmReader(FilmReader&&) noexcept = default;
FilmReader& FilmReader::operator=(FilmReader&&) noexcept = default;
FilmReader FilmReader::stream(const std::string&) { refuse(); }
FilmReader FilmReader::device(const std::string&, const Device&) { refuse(); }
int FilmReader::width_px() const { return 0; }
int FilmReader::height_px() const { return 0; }
double FilmReader::fps() const { return 0; }
int FilmReader::frame_count() const { return 0; }
bool FilmReader::read(FilmFrame&) { return false; }
bool FilmReader::skip() { return false; }
bool FilmReader::picture(FilmFrame&) { return false; }
double FilmReader::time_s() const { return 0; }

}  // namespace tactus
#endif
