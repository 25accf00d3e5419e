// Stands in for the CUDA backend in a build without nvcc: there are no devices, and calls that need one throw
// the reason.
#include "tactus/base/error.h"
#include "tactus/compute/cuda/cuda_backend.h"

namespace tactus::cuda {
namespace {
[[noreturn]] void absent() { throw Error(status_text()); }
}  // namespace

int device_count() { return 0; }
std::string status_text() { return "this build has no CUDA (it was made without nvcc)"; }
std::string why_unusable(int) { return status_text(); }
std::vector<DeviceInfo> list_devices() { return {}; }
std::unique_ptr<Device> open_device(DeviceSpec) { absent(); }
bool enable_peer_access(int, int) { absent(); }
void* create_stream(int) { absent(); }
void destroy_stream(void*) noexcept {}
void* create_event(int) { absent(); }
void destroy_event(void*) noexcept {}
void record_event(int, void*, void*) { absent(); }
void wait_event(int, void*, void*) { absent(); }
void synchronize(int, void*) { absent(); }
void synchronize_event(int, void*) { absent(); }
void* create_timing_event(int) { absent(); }
void record_timing_event(int, void*, void*) { absent(); }
double elapsed_ms(void*, void*) { absent(); }
void copy(int, void*, const void*, std::size_t, void*) { absent(); }
void fill(int, void*, unsigned char, std::size_t, void*) { absent(); }
void begin_capture(int, void*) { absent(); }
void* end_capture(int, void*) { absent(); }
void launch_graph(int, void*, void*) { absent(); }
void destroy_graph(void*) noexcept {}
std::size_t algorithm_scratch_bytes(int) { absent(); }
void exclusive_scan(int, void*, std::size_t, const int*, int*, int, void*) { absent(); }
void exclusive_scan(int, void*, std::size_t, const std::uint64_t*, std::uint64_t*, int, void*) { absent(); }
void compact(int, void*, std::size_t, const int*, int*, int*, Count, void*) { absent(); }
void sort_pairs(int, void*, std::size_t, unsigned*, int*, unsigned*, int*, int, int, void*) { absent(); }
std::string why_not_shared_with_gl(int) { return status_text(); }
void* register_gl_buffer(int, unsigned) { absent(); }
void unregister_gl_buffer(int, void*) noexcept {}
void copy_to_gl_buffer(int, void*, const void*, std::size_t, void*) { absent(); }
}  // namespace tactus::cuda
