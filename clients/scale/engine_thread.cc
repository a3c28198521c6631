#include "clients/scale/engine_thread.h"

#include <future>
#include <utility>

namespace skein {
namespace {

Result<size_t> CancelAll(Engine& engine) {
  const Result<std::vector<WorkerJob>> jobs = engine.List();
  if (!jobs.ok()) return jobs.status();
  std::vector<std::string> workers;
  for (const WorkerJob& job : *jobs) workers.push_back(job.name);
  const Status status = workers.empty() ? Status::Ok() : engine.Cancel(workers);
  if (!status.ok()) return status;
  return workers.size();
}

}  // namespace

EngineThread::EngineThread(PollLoop& loop, std::unique_ptr<Engine> engine)
    : engine_(std::move(engine)), worker_(loop) {}

void EngineThread::List(std::function<void(const Jobs&)> then) {
  worker_.Run([this] { return engine_->List(); }, std::move(then));
}

void EngineThread::Submit(const std::string& batch, const std::vector<std::string>& invitations,
                          const std::vector<std::string>& job_options,
                          const std::vector<std::string>& launch_options,
                          std::function<void(const Status&)> then) {
  worker_.Run(
      [this, batch, invitations, job_options, launch_options] {
        return engine_->Submit(batch, invitations, job_options, launch_options);
      },
      std::move(then));
}

void EngineThread::Cancel(const std::vector<std::string>& workers,
                          std::function<void(const Status&)> then) {
  worker_.Run([this, workers] { return engine_->Cancel(workers); }, std::move(then));
}

template <class Job>
auto EngineThread::RunAndWait(Job job) {
  using R = std::invoke_result_t<Job&>;
  const auto task = std::make_shared<std::packaged_task<R()>>(std::move(job));
  std::future<R> result = task->get_future();
  worker_.Run([task] { (*task)(); }, [] {});
  return result.get();
}

EngineThread::Jobs EngineThread::ListAndWait() {
  return RunAndWait([this] { return engine_->List(); });
}

Result<size_t> EngineThread::CancelAllAndWait() {
  return RunAndWait([this] { return CancelAll(*engine_); });
}

}  // namespace skein
