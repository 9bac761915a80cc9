"""Which effects explain the data: the search, its validation, and the verdict.

1. `null_model`: the model as it is is fitted, and the colour of the noise learnt beside a model in
   which every effect may help, so that a missing effect does not pass for noise.
2. `linear`: residuals linearised there give the evidence of "these effects
   are large, all others small" for every hypothesis, by matrices of the size of the parameters.
3. `search`, `refit`: the leaders are refitted; effects are added, swapped and taken away one by one
   while the evidence grows. Where the motion depends on the model, it is found again in between.
4. `significance`: a bootstrap of the whole search on logs in which nothing is missing.
5. `cross_validation`, `selection`: an effect stays where data that the fit has not seen are
   predicted better by more than one standard error; the fewest such effects are selected.
6. `formula`: terms beyond the catalogue.
7. `joint`: all effects and nominal figures at one joint estimate, with intervals.
8. `verdict`: what is said, and what an answer leaves. `structure`: the same for a model
   with another structure.
"""
