#include "tactus/media/h264_encoder.h"

#include <wels/codec_api.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>

#include "tactus/base/error.h"

namespace tactus {

struct H264Encoder::State {
  ISVCEncoder* encoder = nullptr;
  int width_px = 0, height_px = 0;
  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (encoder == nullptr) return;
    encoder->Uninitialize();
    WelsDestroySVCEncoder(encoder);
  }
};

namespace {

/// Quantiser of the standard, 0 to 51: lines and text stay sharp at 24.
constexpr int kQuantiser = 24, kSecondsPerKey = 2;

/// One unit without its start code goes behind its length, or to the parameters.
void sort_unit(const std::uint8_t* at, std::size_t size, H264Frame& frame) {
  const std::size_t start = size > 3 && at[2] == 1 ? 3 : 4;
  if (size <= start) return;
  at += start;
  size -= start;
  const int kind = at[0] & 31;
  if (kind == 7) return frame.sps.assign(at, at + size);
  if (kind == 8) return frame.pps.assign(at, at + size);
  for (int shift = 24; shift >= 0; shift -= 8)
    frame.units.push_back(static_cast<std::uint8_t>(size >> shift));
  frame.units.insert(frame.units.end(), at, at + size);
}

}  // namespace

H264Encoder::H264Encoder(int width_px, int height_px, double fps) : state_(std::make_unique<State>()) {
  if (WelsCreateSVCEncoder(&state_->encoder) != 0) throw Error("OpenH264 can't be started");
  state_->width_px = width_px;
  state_->height_px = height_px;
  int quiet = WELS_LOG_QUIET;
  state_->encoder->SetOption(ENCODER_OPTION_TRACE_LEVEL, &quiet);
  SEncParamExt p{};
  state_->encoder->GetDefaultParams(&p);
  p.iUsageType = CAMERA_VIDEO_REAL_TIME;
  p.iPicWidth = width_px;
  p.iPicHeight = height_px;
  p.fMaxFrameRate = static_cast<float>(std::min(fps, 60.0));  // the quantiser is fixed, so only a hint
  p.iRCMode = RC_OFF_MODE;
  p.bEnableFrameSkip = false;
  p.uiIntraPeriod = static_cast<unsigned>(std::lround(fps * kSecondsPerKey));
  p.eSpsPpsIdStrategy = CONSTANT_ID;
  p.iMultipleThreadIdc = static_cast<unsigned short>(std::clamp(std::thread::hardware_concurrency(), 1U, 4U));
  p.iSpatialLayerNum = 1;
  p.sSpatialLayers[0].iVideoWidth = width_px;
  p.sSpatialLayers[0].iVideoHeight = height_px;
  p.sSpatialLayers[0].fFrameRate = p.fMaxFrameRate;
  p.sSpatialLayers[0].iDLayerQp = kQuantiser;
  p.sSpatialLayers[0].sSliceArgument.uiSliceMode = SM_SINGLE_SLICE;
  if (state_->encoder->InitializeExt(&p) != 0)
    throw Error("OpenH264 takes no frames of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                " px, expected sides of 16 px or more and at most 9 megapixels");
}

H264Encoder::~H264Encoder() = default;

H264Frame H264Encoder::encode(const std::uint8_t* i420, std::int64_t time_ms) {
  State& s = *state_;
  SSourcePicture picture{};
  picture.iColorFormat = videoFormatI420;
  picture.iPicWidth = s.width_px;
  picture.iPicHeight = s.height_px;
  picture.uiTimeStamp = time_ms;
  const std::size_t pixels = static_cast<std::size_t>(s.width_px) * static_cast<std::size_t>(s.height_px);
  auto* planes = const_cast<std::uint8_t*>(i420);  // the encoder only reads
  picture.pData[0] = planes;
  picture.pData[1] = planes + pixels;
  picture.pData[2] = planes + pixels + pixels / 4;
  picture.iStride[0] = s.width_px;
  picture.iStride[1] = picture.iStride[2] = s.width_px / 2;
  SFrameBSInfo info{};
  if (s.encoder->EncodeFrame(&picture, &info) != 0 || info.eFrameType == videoFrameTypeInvalid ||
      info.eFrameType == videoFrameTypeSkip)
    throw Error("OpenH264 can't encode a frame");
  H264Frame frame;
  frame.is_key = info.eFrameType == videoFrameTypeIDR;
  for (int l = 0; l < info.iLayerNum; ++l) {
    const SLayerBSInfo& layer = info.sLayerInfo[l];
    const std::uint8_t* at = layer.pBsBuf;
    for (int n = 0; n < layer.iNalCount; ++n) {
      sort_unit(at, static_cast<std::size_t>(layer.pNalLengthInByte[n]), frame);
      at += layer.pNalLengthInByte[n];
    }
  }
  return frame;
}

}  // namespace tactus
