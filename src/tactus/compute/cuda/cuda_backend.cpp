#include "tactus/compute/cuda/cuda_backend.h"

#include <algorithm>
#include <atomic>

#include "tactus/base/log.h"
#include "tactus/compute/cuda/cuda_check.h"
#include "tactus/compute/cuda/cuda_code.h"

namespace tactus::cuda {
namespace {

cudaStream_t as_stream(void* stream) { return static_cast<cudaStream_t>(stream); }
cudaEvent_t as_event(void* event) { return static_cast<cudaEvent_t>(event); }
void use(int ordinal) { TACTUS_CUDA_CHECK(cudaSetDevice(ordinal)); }

/// Neither starts anything on the GPU.
GpuCode code_of(int ordinal) {
  int major = 0, minor = 0, driver = 0, runtime = 0;
  TACTUS_CUDA_CHECK(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, ordinal));
  TACTUS_CUDA_CHECK(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, ordinal));
  TACTUS_CUDA_CHECK(cudaDriverGetVersion(&driver));
  TACTUS_CUDA_CHECK(cudaRuntimeGetVersion(&runtime));
  return code_for(parse_build_code(TACTUS_CUDA_CODE), 10 * major + minor, driver, runtime);
}

class CudaDevice final : public Device {
 public:
  explicit CudaDevice(DeviceSpec spec) : Device(spec) {
    TACTUS_CUDA_CHECK(
        cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, spec.ordinal));
  }
  int multiprocessors() const override { return multiprocessors_; }

  void* allocate(std::size_t bytes) override {
    use(ordinal());
    void* memory = nullptr;
    if (const cudaError_t status = cudaMalloc(&memory, std::max<std::size_t>(bytes, 1));
        status != cudaSuccess) {
      cudaGetLastError();
      std::size_t free = 0, total = 0;
      cudaMemGetInfo(&free, &total);
      throw Error(name() + ": not enough memory for " + bytes_text(static_cast<double>(bytes)) + " (" +
                  bytes_text(static_cast<double>(free)) + " free): " + cudaGetErrorString(status));
    }
    return memory;
  }
  void deallocate(void* memory) noexcept override {
    cudaSetDevice(ordinal());
    cudaFree(memory);
  }
  void* allocate_host(std::size_t bytes) override {
    use(ordinal());
    void* memory = nullptr;
    TACTUS_CUDA_CHECK(cudaHostAlloc(&memory, std::max<std::size_t>(bytes, 1), cudaHostAllocPortable));
    return memory;
  }
  void deallocate_host(void* memory) noexcept override { cudaFreeHost(memory); }

 private:
  int multiprocessors_ = 0;
};

}  // namespace

int device_count() {
  int count = 0;
  // A program with the static runtime starts without a driver; the call then fails and leaves the count
  // undefined.
  return cudaGetDeviceCount(&count) == cudaSuccess ? count : 0;
}

std::string status_text() {
  int driver = 0, runtime = 0, count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  cudaDriverGetVersion(&driver);
  cudaRuntimeGetVersion(&runtime);
  if (driver == 0) return "there is no NVIDIA driver (built with CUDA " + version_text(runtime) + ")";
  if (status != cudaSuccess) return std::string("CUDA is not usable: ") + cudaGetErrorString(status);
  return "driver " + version_text(driver) + ", runtime " + version_text(runtime);
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> devices;
  const int count = device_count();
  for (int i = 0; i < count; ++i) {
    cudaDeviceProp properties{};
    TACTUS_CUDA_CHECK(cudaGetDeviceProperties(&properties, i));
    DeviceInfo info{{DeviceKind::cuda, i},
                    properties.name,
                    static_cast<double>(properties.totalGlobalMem),
                    properties.multiProcessorCount,
                    {},
                    {},
                    {},
                    true};
    const GpuCode code = code_of(i);
    info.capability = capability_text(10 * properties.major + properties.minor);
    info.code = code.text;
    info.usable = code.origin != CodeOrigin::none;
    for (int peer = 0; peer < count; ++peer) {
      int can = 0;
      if (peer != i && cudaDeviceCanAccessPeer(&can, i, peer) == cudaSuccess && can != 0)
        info.peer_ordinals.push_back(peer);
    }
    devices.push_back(std::move(info));
  }
  return devices;
}

std::string why_unusable(int ordinal) {
  const GpuCode code = code_of(ordinal);
  if (code.origin != CodeOrigin::none) return "";
  cudaDeviceProp properties{};
  TACTUS_CUDA_CHECK(cudaGetDeviceProperties(&properties, ordinal));
  return "cuda:" + std::to_string(ordinal) + " (" + properties.name + ") is not usable: " + code.text;
}

void note_slow_load(double seconds) {
  static std::atomic<bool> noted = false;
  if (seconds < 0.3 || noted.exchange(true)) return;
  log_info(
      "the driver compiles this build's code for your GPU: this start takes some ten seconds more, later "
      "ones "
      "don't");
}

std::unique_ptr<Device> open_device(DeviceSpec spec) {
  if (const std::string why = why_unusable(spec.ordinal); !why.empty()) throw Error(why);
  use(spec.ordinal);
  return std::make_unique<CudaDevice>(spec);
}

bool enable_peer_access(int reader, int owner) {
  if (reader == owner) return true;
  int can = 0;
  TACTUS_CUDA_CHECK(cudaDeviceCanAccessPeer(&can, reader, owner));
  if (can == 0) return false;
  use(reader);
  const cudaError_t status = cudaDeviceEnablePeerAccess(owner, 0);
  cudaGetLastError();  // "already enabled" is fine, and sticks otherwise
  return status == cudaSuccess || status == cudaErrorPeerAccessAlreadyEnabled;
}

void* create_stream(int ordinal) {
  use(ordinal);
  cudaStream_t stream = nullptr;
  TACTUS_CUDA_CHECK(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  return stream;
}
void destroy_stream(void* stream) noexcept { cudaStreamDestroy(as_stream(stream)); }
void* create_event(int ordinal) {
  use(ordinal);
  cudaEvent_t event = nullptr;
  TACTUS_CUDA_CHECK(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
  return event;
}
void destroy_event(void* event) noexcept { cudaEventDestroy(as_event(event)); }
void record_event(int ordinal, void* event, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaEventRecord(as_event(event), as_stream(stream)));
}
void wait_event(int ordinal, void* stream, void* event) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaStreamWaitEvent(as_stream(stream), as_event(event), 0));
}
void synchronize(int ordinal, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaStreamSynchronize(as_stream(stream)));
}
void* create_timing_event(int ordinal) {
  use(ordinal);
  cudaEvent_t event = nullptr;
  TACTUS_CUDA_CHECK(cudaEventCreate(&event));
  return event;
}
void record_timing_event(int ordinal, void* event, void* stream) {
  use(ordinal);
  cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;  // of any stream that a recording includes
  TACTUS_CUDA_CHECK(cudaStreamIsCapturing(as_stream(stream), &status));
  TACTUS_CUDA_CHECK(cudaEventRecordWithFlags(
      as_event(event), as_stream(stream),
      status == cudaStreamCaptureStatusNone ? cudaEventRecordDefault : cudaEventRecordExternal));
}
double elapsed_ms(void* from, void* to) {
  float ms = 0;
  const cudaError_t status = cudaEventElapsedTime(&ms, as_event(from), as_event(to));
  if (status == cudaErrorInvalidResourceHandle) {  // one is in a recording that never ran
    cudaGetLastError();
    return 0;
  }
  TACTUS_CUDA_CHECK(status);
  return static_cast<double>(ms);
}
void synchronize_event(int ordinal, void* event) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaEventSynchronize(as_event(event)));
}
void copy(int ordinal, void* to, const void* from, std::size_t bytes, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDefault, as_stream(stream)));
}
void fill(int ordinal, void* what, unsigned char byte, std::size_t bytes, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaMemsetAsync(what, byte, bytes, as_stream(stream)));
}

void begin_capture(int ordinal, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaStreamBeginCapture(as_stream(stream), cudaStreamCaptureModeThreadLocal));
}
void* end_capture(int ordinal, void* stream) {
  use(ordinal);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  TACTUS_CUDA_CHECK(cudaStreamEndCapture(as_stream(stream), &graph));
  const cudaError_t status = cudaGraphInstantiate(&executable, graph, 0);
  cudaGraphDestroy(graph);
  TACTUS_CUDA_CHECK(status);
  // Else the first launch does it: 2 to 9 ms for a block of 16 substeps.
  TACTUS_CUDA_CHECK(cudaGraphUpload(executable, as_stream(stream)));
  return executable;
}
void launch_graph(int ordinal, void* graph, void* stream) {
  use(ordinal);
  TACTUS_CUDA_CHECK(cudaGraphLaunch(static_cast<cudaGraphExec_t>(graph), as_stream(stream)));
}
void destroy_graph(void* graph) noexcept { cudaGraphExecDestroy(static_cast<cudaGraphExec_t>(graph)); }

}  // namespace tactus::cuda
