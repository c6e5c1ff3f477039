// Whether a listener can be served, and whether anybody whom it lets in can reach it. Listeners
// come from the readers; what is wrong goes to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/catalog/catalog.h"
#include "config/model/listener.h"
#include "config/model/mark.h"
#include "config/model/problem.h"

namespace baudgate::config {

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems);
/// Whether the next entry of `listener.clients` can ever apply. `mark`: of its `from`.
void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems);

}  // namespace baudgate::config
