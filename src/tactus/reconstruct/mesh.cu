#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/reconstruct/depth/depth_mesh_kernels.h"
#include "tactus/reconstruct/mesh_kernels.h"
#include "tactus/reconstruct/mesh_part_kernels.h"
#include "tactus/reconstruct/normal_kernels.h"
#include "tactus/reconstruct/smoothing_kernels.h"
#include "tactus/reconstruct/texture/atlas_kernels.h"
#include "tactus/reconstruct/texture/texture_kernels.h"
#include "tactus/reconstruct/vertex_kernels.h"

TACTUS_CUDA_KERNEL(tactus::CountBrickMesh);
TACTUS_CUDA_KERNEL(tactus::EmitVertices);
TACTUS_CUDA_KERNEL(tactus::EmitTriangles);
TACTUS_CUDA_KERNEL(tactus::NumberBricks);
TACTUS_CUDA_KERNEL(tactus::PlacePart);
TACTUS_CUDA_KERNEL(tactus::PushWords);
TACTUS_CUDA_KERNEL(tactus::AddFaceNormals);
TACTUS_CUDA_KERNEL(tactus::AddCornerNormals);
TACTUS_CUDA_KERNEL(tactus::NormalizeSums);
TACTUS_CUDA_KERNEL(tactus::ListCorners);
TACTUS_CUDA_KERNEL(tactus::FindFans);
TACTUS_CUDA_KERNEL(tactus::MeasureFaces);
TACTUS_CUDA_KERNEL(tactus::FilterNormals);
TACTUS_CUDA_KERNEL(tactus::FollowNormals);
TACTUS_CUDA_KERNEL(tactus::FindGrowth);
TACTUS_CUDA_KERNEL(tactus::RestoreVolume);
TACTUS_CUDA_KERNEL(tactus::DrawDepthMaps);
TACTUS_CUDA_KERNEL(tactus::WidenDepthMaps);
TACTUS_CUDA_KERNEL(tactus::MarkOutlines);
TACTUS_CUDA_KERNEL(tactus::ColorVertices);
TACTUS_CUDA_KERNEL(tactus::AddNeighbourColors);
TACTUS_CUDA_KERNEL(tactus::FillColors);
TACTUS_CUDA_KERNEL(tactus::ChooseTrianglePhotos);
TACTUS_CUDA_KERNEL(tactus::CutAtDepth);
