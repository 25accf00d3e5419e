#pragma once
/// The CUDA runtime behind plain functions, so that g++ builds without nvcc. Without CUDA: stubs that say
/// why.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tactus/compute/device.h"
#include "tactus/compute/kernel.h"

namespace tactus::cuda {

int device_count();
std::string status_text();
/// Why the build's code can't run on a GPU that the driver lists, with its name and a remedy; "" where it
/// can.
std::string why_unusable(int ordinal);
/// Reports once that loading kernels takes long because the driver compiles them. @param seconds one kernel
/// took
void note_slow_load(double seconds);
std::vector<DeviceInfo> list_devices();
std::unique_ptr<Device> open_device(DeviceSpec spec);
/// Lets kernels on one GPU read another's memory. @throws Error when the machine can't.
bool enable_peer_access(int reader, int owner);

void* create_stream(int ordinal);
void destroy_stream(void* stream) noexcept;
void* create_event(int ordinal);
void destroy_event(void* event) noexcept;
void record_event(int ordinal, void* event, void* stream);
void wait_event(int ordinal, void* stream, void* event);
void synchronize(int ordinal, void* stream);
void synchronize_event(int ordinal, void* event);
void* create_timing_event(int ordinal);
/// Also in a recording.
void record_timing_event(int ordinal, void* event, void* stream);
double elapsed_ms(void* from, void* to);
void copy(int ordinal, void* to, const void* from, std::size_t bytes, void* stream);
void fill(int ordinal, void* what, unsigned char byte, std::size_t bytes, void* stream);

void begin_capture(int ordinal, void* stream);
void* end_capture(int ordinal, void* stream);  ///< an instantiated graph
void launch_graph(int ordinal, void* graph, void* stream);
void destroy_graph(void* graph) noexcept;

/// Bytes of scratch that the algorithms below need for n elements.
std::size_t algorithm_scratch_bytes(int n);
void exclusive_scan(int ordinal, void* scratch, std::size_t scratch_bytes, const int* in, int* out, int n,
                    void* stream);
void exclusive_scan(int ordinal, void* scratch, std::size_t scratch_bytes, const std::uint64_t* in,
                    std::uint64_t* out, int n, void* stream);
/// Ascending indices of the non-zero flags among the first `count`.
void compact(int ordinal, void* scratch, std::size_t scratch_bytes, const int* flags, int* out,
             int* out_count, Count count, void* stream);
void sort_pairs(int ordinal, void* scratch, std::size_t scratch_bytes, unsigned* keys, int* values,
                unsigned* keys2, int* values2, int n, int key_bits, void* stream);

/// OpenGL's buffers; see gl_sharing.h.
std::string why_not_shared_with_gl(int ordinal);
void* register_gl_buffer(int ordinal, unsigned gl_buffer);
void unregister_gl_buffer(int ordinal, void* resource) noexcept;
void copy_to_gl_buffer(int ordinal, void* resource, const void* from, std::size_t bytes, void* stream);

}  // namespace tactus::cuda
