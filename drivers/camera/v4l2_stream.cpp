#include "drivers/camera/v4l2_stream.hpp"

#include <linux/videodev2.h>

#include <cerrno>
#include <utility>

namespace tankrig {

ErrorCode code_of_errno(int problem) noexcept {
  switch (problem) {
    case ENODEV:
    case ENXIO:
    case ENOENT:
    case EBADF:
      return ErrorCode::kDisconnected;
    case EBUSY:
    case ENOSPC:  // no USB bandwidth left
    case EPERM:
    case EACCES:
      return ErrorCode::kRefused;
    case ENOMEM:
      return ErrorCode::kInternal;
    default:
      return ErrorCode::kIo;
  }
}

Status V4l2Stream::failed(int problem, const char* where) noexcept {
  stop();
  return Error{code_of_errno(problem), problem, device_.now(), where};
}

Status V4l2Stream::start(int count) {
  stop();
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(count);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int problem = device_.call(VIDIOC_REQBUFS, &request); problem != 0)
    return failed(problem, "v4l2: request buffers");
  requested_ = true;
  if (request.count < 2) return failed(ENOMEM, "v4l2: fewer than two buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int problem = device_.call(VIDIOC_QUERYBUF, &buffer); problem != 0)
      return failed(problem, "v4l2: query buffer");
    std::uint8_t* memory = device_.map(buffer.length, buffer.m.offset);
    if (!memory) return failed(ENOMEM, "v4l2: map buffer");
    buffers_.emplace_back(memory, buffer.length);
    if (const int problem = give_back(buffer); problem != 0) return failed(problem, "v4l2: queue buffer");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int problem = device_.call(VIDIOC_STREAMON, &type); problem != 0) return failed(problem, "v4l2: stream on");
  return {};
}

void V4l2Stream::stop() noexcept {
  if (!std::exchange(requested_, false)) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  device_.call(VIDIOC_STREAMOFF, &type);
  for (const std::span<std::uint8_t> memory : buffers_) device_.unmap(memory.data(), memory.size());
  buffers_.clear();
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  device_.call(VIDIOC_REQBUFS, &none);
}

int V4l2Stream::take(v4l2_buffer& buffer) noexcept {
  buffer = {};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int problem = device_.call(VIDIOC_DQBUF, &buffer);
  return problem == 0 && buffer.index >= buffers_.size() ? EIO : problem;
}

std::span<const std::uint8_t> V4l2Stream::memory(const v4l2_buffer& buffer) const noexcept {
  return buffers_[buffer.index];
}

int V4l2Stream::give_back(v4l2_buffer& buffer) noexcept {
  v4l2_buffer empty{};
  empty.index = buffer.index;
  empty.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  empty.memory = V4L2_MEMORY_MMAP;
  return device_.call(VIDIOC_QBUF, &empty);
}

}  // namespace tankrig
