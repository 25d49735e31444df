"""All displacement models on one data set, in and out of sample."""
