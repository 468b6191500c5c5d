#include "console/platform/arrivals.hpp"

#include <boost/asio/post.hpp>
#include <exception>
#include <utility>

namespace fs = std::filesystem;

namespace tankrig {

Arrivals::Arrivals(boost::asio::io_context& io, const fs::path& store,
                   std::function<fs::path(const std::string& id)> place_of, std::function<void(Batch)> brought)
    : io_(io), disk_(store), place_of_(std::move(place_of)), brought_(std::move(brought)), thread_([this] { run(); }) {}

Arrivals::~Arrivals() {
  {
    const std::scoped_lock lock(mutex_);
    over_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Arrivals::bring(std::shared_ptr<Arriving> upload, std::function<void(const Brought&)> done) {
  {
    const std::scoped_lock lock(mutex_);
    waiting_.push_back({std::move(upload), "", std::move(done)});
  }
  wake_.notify_one();
}

void Arrivals::confirm(Batch batch) {
  {
    const std::scoped_lock lock(mutex_);
    for (Brought& one : batch) entered_.push_back(std::move(one));
  }
  wake_.notify_one();
}

void Arrivals::run() {
  while (true) {
    Batch fresh, entered;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return over_ || !waiting_.empty() || !entered_.empty(); });
      if (over_) return;
      fresh.swap(waiting_);
      entered.swap(entered_);
    }
    put_in_place(fresh);
    try {
      disk_.sync();
    } catch (const InputError& e) {
      for (Batch* batch : {&fresh, &entered})
        for (Brought& one : *batch) one.why_not = e.what();
    }
    boost::asio::post(io_, [this, placed = std::move(fresh), told = std::move(entered)]() mutable {
      for (const Brought& one : told) one.done(one);
      if (!placed.empty()) brought_(std::move(placed));
    });
  }
}

void Arrivals::put_in_place(Batch& batch) {
  for (Brought& one : batch) try {
      const Submission& s = one.upload->submission;
      const fs::path place = place_of_(s.id);
      fs::create_directory(place);
      fs::create_hard_link(one.upload->file.path(), place / s.file);
    } catch (const std::exception& e) {
      one.why_not = e.what();
    }
}

}  // namespace tankrig
