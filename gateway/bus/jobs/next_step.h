// The next step of a job, as a value. Made by the parts of a job: job_asking.h, job_departure.h,
// job_answer.h and job_finish.h. Carried out by gateway/bus/jobs/job_run.cpp alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/jobs/job.h"

namespace baudgate {

struct NextStep {
  enum class What : std::uint8_t {
    wait,           ///< its request is ready and waits for the line
    send,           ///< that request goes out now
    hold,           ///< the line waits with it, until no late reply can come
    ask,            ///< the next request of its task, or the same step anew
    probe_first,    ///< a probe of its device goes first
    go_unproved,    ///< the probe cannot be asked; the job behind it goes on. `end.reason`: why not
    take_answer,    ///< its answer counts
    park,           ///< it waits beside the line, until `until`
    back_in_queue,  ///< the requests of its clients wait again
    finish,         ///< it ends, as `end` says
  };

  static NextStep Wait() { return {}; }
  static NextStep Send() { return {.what = What::send}; }
  static NextStep Hold() { return {.what = What::hold}; }
  /// `retries`: see Job::Step.
  static NextStep Ask(int retries = 0) { return {.what = What::ask, .retries = retries}; }
  static NextStep ProbeFirst() { return {.what = What::probe_first}; }
  static NextStep GoUnproved(std::string why) {
    return {.what = What::go_unproved, .end = {Outcome::none, std::move(why)}};
  }
  static NextStep TakeAnswer() { return {.what = What::take_answer}; }
  static NextStep Park(Instant until) { return {.what = What::park, .until = until}; }
  static NextStep BackInQueue() { return {.what = What::back_in_queue}; }
  static NextStep Finish(Outcome outcome, std::string reason) {
    return {.what = What::finish, .end = {outcome, std::move(reason)}};
  }

  What what = What::wait;
  int retries = 0;
  Instant until{};
  JobEnd end{};
};

}  // namespace baudgate
