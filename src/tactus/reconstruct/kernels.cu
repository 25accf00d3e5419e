#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/reconstruct/atlas_kernels.h"
#include "tactus/reconstruct/depth_mesh_kernels.h"
#include "tactus/reconstruct/depth_seam_kernels.h"
#include "tactus/reconstruct/hull_check_kernels.h"
#include "tactus/reconstruct/mesh_kernels.h"
#include "tactus/reconstruct/mesh_part_kernels.h"
#include "tactus/reconstruct/normal_kernels.h"
#include "tactus/reconstruct/smoothing_kernels.h"
#include "tactus/reconstruct/texture_kernels.h"
#include "tactus/reconstruct/tolerant_kernels.h"
#include "tactus/reconstruct/vertex_kernels.h"
#include "tactus/reconstruct/view_count_kernels.h"
#include "tactus/reconstruct/view_score_kernels.h"

TACTUS_CUDA_KERNEL(tactus::PrepareSilhouettes);
TACTUS_CUDA_KERNEL(tactus::SumCellColumns);
TACTUS_CUDA_KERNEL(tactus::PrepareWindows);
TACTUS_CUDA_KERNEL(tactus::SortRegions);
TACTUS_CUDA_KERNEL(tactus::ClassifyBricks);
TACTUS_CUDA_KERNEL(tactus::AssignSlots);
TACTUS_CUDA_KERNEL(tactus::FetchGhosts);
TACTUS_CUDA_KERNEL(tactus::BrickSigns);
TACTUS_CUDA_KERNEL(tactus::TolerantSigns);
TACTUS_CUDA_KERNEL(tactus::CountBrickMesh);
TACTUS_CUDA_KERNEL(tactus::EmitVertices);
TACTUS_CUDA_KERNEL(tactus::EmitTolerantVertices);
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
TACTUS_CUDA_KERNEL(tactus::BlameSamples);
TACTUS_CUDA_KERNEL(tactus::CountBlame);
TACTUS_CUDA_KERNEL(tactus::VoteViews);
TACTUS_CUDA_KERNEL(tactus::ClearUnseen);
TACTUS_CUDA_KERNEL(tactus::MarkTiles);
TACTUS_CUDA_KERNEL(tactus::PrepareDepth);
TACTUS_CUDA_KERNEL(tactus::FindHoles);
TACTUS_CUDA_KERNEL(tactus::FadeDepth);
TACTUS_CUDA_KERNEL(tactus::VoteDepth);
TACTUS_CUDA_KERNEL(tactus::DepthSigns);
TACTUS_CUDA_KERNEL(tactus::CutAtDepth);
